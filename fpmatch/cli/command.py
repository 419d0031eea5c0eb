"""Commands: short help in groups, rare options behind ``--help-all``."""

from __future__ import annotations

import inspect
from copy import copy
from importlib import import_module
from typing import Any, Final, cast

import click

from fpmatch.cli.notes import show
from fpmatch.errors import did_you_mean

# Options that commands share, by their names; the others come first, under "Options".
GROUPS: Final = {
    "Prints": (
        *("dpi", "probe_dpi", "reference_dpi", "raw", "mirror", "polarity", "enhance", "angles"),
        *("pattern", "by_folder", "prefix"),
    ),
    "Overlay": ("view",),
    "Resources": ("workers", "scheduler", "key"),
}
_EVERYTHING: Final = "fpmatch.help_all"


def _show_everything(ctx: click.Context, _: click.Parameter, requested: bool) -> None:
    if requested and not ctx.resilient_parsing:
        ctx.meta[_EVERYTHING] = True
        show(ctx.get_help())
        ctx.exit()


HELP_ALL: Final = click.Option(
    ["--help-all"],
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_everything,
    help="Show rare options and details, too.",
)


class Command(click.Command):
    """A command that shows its rare options, which are hidden, and `details` by ``--help-all``.

    A hidden option without a help text is not shown at all.
    """

    def __init__(self, *args: Any, details: str = "", **attrs: Any) -> None:
        super().__init__(*args, **attrs)
        self.details = details

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return the parameters, the options about help last."""
        return [*super().get_params(ctx), HELP_ALL]

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the options in groups."""
        rows: dict[str, list[tuple[str, str]]] = {title: [] for title in ("Options", *GROUPS)}
        for param in self.get_params(ctx):
            if isinstance(param, click.Option):
                shown = copy(param)
                shown.hidden = param.hidden and not (param.help and _EVERYTHING in ctx.meta)
                if record := shown.get_help_record(ctx):
                    group = (title for title, names in GROUPS.items() if param.name in names)
                    rows[next(group, "Options")].append(record)
        for title, records in rows.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the epilog; if everything is to be shown, the details before it."""
        if self.details and _EVERYTHING in ctx.meta:
            formatter.write_paragraph()
            with formatter.indentation():
                formatter.write_text(inspect.cleandoc(self.details))
        super().format_epilog(ctx, formatter)


class Group(click.Group):
    """A group whose list of commands contains whole sentences."""

    command_class = Command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the sub-command that is named first; of an unknown name, say what is meant."""
        name = click.utils.make_str(args[0])
        if not (ctx.resilient_parsing or name.startswith("-") or self.is_known(ctx, name)):
            ctx.fail(f"No such command {name!r}.{did_you_mean(name, self.list_commands(ctx))}")
        return super().resolve_command(ctx, args)

    def is_known(self, ctx: click.Context, name: str) -> bool:
        """Return whether there is a sub-command of this name."""
        return name in self.list_commands(ctx)

    def summaries(self, ctx: click.Context) -> dict[str, str]:
        """Return the first sentence about each sub-command."""
        names = self.list_commands(ctx)
        known = {name: command for name in names if (command := self.get_command(ctx, name))}
        return {name: command.get_short_help_str(limit=1000) for name, command in known.items()}

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the sub-commands."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self.summaries(ctx).items()))


class LazyGroup(Group):
    """Import a sub-command, the last part of its module's name, when it runs.

    The module is `prefix`, as ``package.`` or ``package.group_``, with the sub-command's name.
    """

    def __init__(self, *, summaries: dict[str, str], prefix: str, **attrs: Any) -> None:
        super().__init__(**attrs)
        self._summaries, self._prefix = summaries, prefix

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names, in the order of the summaries."""
        return list(self._summaries)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the sub-command `cmd_name`, if there is one."""
        if cmd_name not in self._summaries:
            return None
        module = f"{self._prefix}{cmd_name}"
        return cast("click.Command", getattr(import_module(module), module.rpartition(".")[2]))

    def is_known(self, ctx: click.Context, name: str) -> bool:
        """Return whether there is a sub-command of this name, without a list of all."""
        return name in self._summaries or super().is_known(ctx, name)

    def summaries(self, ctx: click.Context) -> dict[str, str]:
        """Return the summaries, without importing the sub-commands."""
        return self._summaries
