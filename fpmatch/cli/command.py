"""Commands and groups: help in sections, rare options behind ``--help-all``, lazy imports."""

from __future__ import annotations

import inspect
from copy import copy
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, cast

import click
from click.core import ParameterSource

from fpmatch.cli.notes import show
from fpmatch.errors import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Mapping

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
        _write_sections(formatter, rows)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the epilog; if everything is to be shown, the details before it."""
        if self.details and _EVERYTHING in ctx.meta:
            formatter.write_paragraph()
            with formatter.indentation():
                formatter.write_text(inspect.cleandoc(self.details))
        super().format_epilog(ctx, formatter)


class Group(click.Group):
    """A group that imports a sub-command when it runs, as click's documentation has it.

    `lazy` has the place of each such command, ``package.module:object``, by name.
    """

    command_class = Command

    def __init__(self, *args: Any, lazy: Mapping[str, str] | None = None, **attrs: Any) -> None:
        super().__init__(*args, **attrs)
        self.lazy = lazy or {}

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all sub-commands."""
        return [*self.lazy, *super().list_commands(ctx)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the sub-command `cmd_name`, if there is one."""
        if cmd_name in self.lazy:
            return cast("click.Command", load_object(self.lazy[cmd_name], used_by=cmd_name))
        return super().get_command(ctx, cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the sub-command that is named first; of an unknown name, say what is meant."""
        name = click.utils.make_str(args[0])
        known = ctx.resilient_parsing or name in self.lazy or name in self.list_commands(ctx)
        if not known and not name.startswith("-"):
            ctx.fail(f"No such command {name!r}.{did_you_mean(name, self.list_commands(ctx))}")
        return super().resolve_command(ctx, args)

    def sections(self, ctx: click.Context) -> dict[str, dict[str, str]]:
        """Return the first sentence about each sub-command, by the title of its section."""
        names = self.list_commands(ctx)
        known = {name: command for name in names if (command := self.get_command(ctx, name))}
        texts = {name: command.get_short_help_str(limit=1000) for name, command in known.items()}
        return {"Commands": texts}

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the sub-commands with their sentences."""
        sections = self.sections(ctx)
        _write_sections(formatter, {title: list(of.items()) for title, of in sections.items()})


def _write_sections(
    formatter: click.HelpFormatter, rows: Mapping[str, list[tuple[str, str]]]
) -> None:
    for title, records in rows.items():
        if records:
            with formatter.section(title):
                formatter.write_dl(records)


def load_object(place: str, *, used_by: str) -> Any:
    """Return the object at ``package.module:object``; fail in one line where it is not installed.

    The wings (gallery, server, lab) are loaded so: the core imports none of them.
    """
    module, _, name = place.partition(":")
    package = ".".join(module.split(".")[:2])
    try:
        return getattr(import_module(module), name)
    except ImportError as error:
        if error.name is None or not f"{error.name}.".startswith(f"{package}."):
            raise
        reason = f"{used_by!r} needs the package {package}, which cannot be imported"
        raise click.UsageError(reason) from error


def check_combination(
    needs: Mapping[str, str] | None = None, *, excluding: str = "", excluded: tuple[str, ...] = ()
) -> None:
    """Fail where options of the current command line do not go together.

    `needs` names, for parameters, another one without which they mean nothing; those that are
    `excluded` cannot be combined with the parameter `excluding`, if that is given.
    """
    ctx = click.get_current_context()
    names = {
        param.name or "": param.human_readable_name
        if isinstance(param, click.Argument)
        else param.opts[0]
        for param in ctx.command.params
    }
    given = {
        name for name in names if ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE
    }
    for name, needed in (needs or {}).items():
        if name in given and needed not in given:
            raise click.UsageError(f"{names[name]} needs {names[needed]}")
    for name in excluded:
        if name in given and excluding in given:
            raise click.UsageError(f"{names[name]} cannot be combined with {names[excluding]}")
