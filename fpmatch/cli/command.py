"""Commands: help in sections, rare options behind ``--help-all``, errors on one line."""

from __future__ import annotations

import inspect
import os
import sys
from copy import copy
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, cast

import click
from click.core import ParameterSource

from fpmatch.cli import EXIT_INTERRUPTED
from fpmatch.cli.notes import say_errors, say_kernels
from fpmatch.errors import FpmatchError, did_you_mean
from fpmatch.printable import message_text

if TYPE_CHECKING:
    from collections.abc import Mapping

# Options that commands share, by their names; the others come first, under "Options".
GROUPS: Final = {
    "Prints": (
        *("dpi", "probe_dpi", "reference_dpi", "raw", "mirror", "polarity", "enhance", "angles"),
        "pattern",
    ),
    "Overlay": ("view",),
    "Resources": ("workers", "scheduler", "key"),
}
EXIT_ERROR: Final = 2
EXIT_BROKEN_PIPE: Final = 141  # 128 + SIGPIPE

HELP_ALL: Final = click.help_option("--help-all", help="Show rare options and details, too.")(
    click.Command("")
).params[0]


def _shows_all(ctx: click.Context) -> bool:
    return ctx.get_parameter_source("help_all") is ParameterSource.COMMANDLINE


class Command(click.Command):
    """A command that shows its rare options, which are hidden, and `details` by ``--help-all``."""

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
            if not isinstance(param, click.Option):
                continue
            shown = copy(param)
            shown.hidden = param.hidden and not _shows_all(ctx)
            if record := shown.get_help_record(ctx):
                group = (title for title, names in GROUPS.items() if param.name in names)
                rows[next(group, "Options")].append(record)
        _write_sections(formatter, rows)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the epilog; if everything is to be shown, the details before it."""
        if self.details and _shows_all(ctx):
            formatter.write_paragraph()
            with formatter.indentation():
                formatter.write_text(inspect.cleandoc(self.details))
        super().format_epilog(ctx, formatter)


class Group(click.Group):
    """A group of such commands, listed with whole sentences."""

    command_class = Command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the sub-commands with the first sentence of each."""
        of = sorted(self.commands.items())
        rows = [(name, command.get_short_help_str(limit=1000)) for name, command in of]
        _write_sections(formatter, {"Commands": rows})


class Program(click.Group):
    """The command ``fpmatch``: it imports sub-commands when they run and prints their errors.

    Sub-commands return the exit status. `sections` has the summaries of all sub-commands, by the
    title of their section and the folder of the package that has them: the command NAME is the
    object NAME of FOLDER.NAME.
    """

    sections: Mapping[tuple[str, str], Mapping[str, str]]

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all sub-commands."""
        return [name for summaries in self.sections.values() for name in summaries]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the sub-command `cmd_name`; of an unknown name, say what is meant."""
        for (_, folder), summaries in self.sections.items():
            if cmd_name in summaries:
                name = cmd_name.replace("-", "_")
                place = f"fpmatch.{folder}.{name}:{name}"
                return cast("click.Command", load_object(place, used_by=cmd_name))
        if not (ctx.resilient_parsing or cmd_name.startswith("-")):
            meant = did_you_mean(cmd_name, self.list_commands(ctx))
            ctx.fail(f"No such command {cmd_name!r}.{meant}")
        return None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the summaries, without importing the commands."""
        rows = {title: list(of.items()) for (title, _), of in self.sections.items()}
        _write_sections(formatter, rows)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a sub-command and exit with its status; print an error on one line."""
        try:
            say_kernels()
            ctx.exit(super().invoke(ctx) or 0)
        except KeyboardInterrupt:
            ctx.exit(EXIT_INTERRUPTED)
        except BrokenPipeError:
            # The reader has gone; otherwise the interpreter reports it again when it flushes.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            ctx.exit(EXIT_BROKEN_PIPE)
        except click.ClickException as error:
            error.message = message_text(error.message)  # type: ignore[misc]  # it repeats words
            raise
        except FpmatchError as error:
            say_errors([error])
        except OSError as error:
            # other files raise FpmatchError: this is the output itself, on a full disk
            say_errors([f"{error.filename or 'output'}: {error.strerror}"])
        ctx.exit(EXIT_ERROR)


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


def check_combination(needs: Mapping[str, str], *, not_with_gallery: tuple[str, ...]) -> None:
    """Fail where options of the current command line do not go together.

    `needs` names, for options, another one without which they mean nothing. The options and
    arguments `not_with_gallery` cannot be combined with ``--gallery``.
    """
    ctx = click.get_current_context()
    given = {
        param.opts[0] if isinstance(param, click.Option) else param.human_readable_name
        for param in ctx.command.params
        if ctx.get_parameter_source(str(param.name)) is ParameterSource.COMMANDLINE
    }
    for option, needed in needs.items():
        if option in given and needed not in given:
            raise click.UsageError(f"{option} needs {needed}")
    for option in not_with_gallery:
        if option in given and "--gallery" in given:
            raise click.UsageError(f"{option} cannot be combined with --gallery")
