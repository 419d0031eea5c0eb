"""The command ``fpmatch``: it imports sub-commands when they run and prints their errors."""

from __future__ import annotations

import os
import sys
from typing import IO, Any, Final, cast

import click

from fpmatch._version import __version__
from fpmatch.cli import EXIT_INTERRUPTED, is_interrupt
from fpmatch.cli.command import LazyGroup
from fpmatch.cli.wings import from_wing, registered, wing_of
from fpmatch.errors import FpmatchError
from fpmatch.printable import message_text

# Each sub-command is the object of its name in the module of its name, which is imported when it
# runs: `fpmatch --help` imports none of them. Other commands are registered by the wings.
CORE: Final = {
    "verify": "Decide whether two images show the same finger.",
    "extract": "Write templates of images, or each stage as a picture.",
    "convert": "Write a template in another format: ISO, ANSI, NIST, JSON, CSV.",
    "inspect": "Show what files contain: format, size, minutiae, quality.",
    "doctor": "Show what is installed: versions, kernels, extras, plug-ins.",
}

EXIT_ERROR: Final = 2
EXIT_BROKEN_PIPE: Final = 141  # 128 + SIGPIPE


class _OneLineError(click.ClickException):
    """An error shown as one line on stderr, with exit status 2."""

    exit_code = EXIT_ERROR

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the line."""
        from fpmatch.cli.notes import say

        say(f"error: {message_text(self.format_message())}")


def _made_printable(error: click.ClickException) -> click.ClickException:
    """Return an error about a command line, which repeats parts of it, as it may be shown."""
    error.message = message_text(error.message)  # type: ignore[misc]
    return error


def summaries() -> dict[str, str]:
    """Return the summaries of all commands, of the core and of the wings that are installed."""
    return CORE | {
        name: text for wing in registered().values() for name, text in wing.commands.items()
    }


class _Fpmatch(LazyGroup):
    """The whole command: sub-commands return the exit status, errors are shown on one line.

    The wings add theirs; other packages may, as entry points of `fpmatch.base.plugins.COMMANDS`.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names, the core's first."""
        return list(summaries())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the sub-command `cmd_name`, of the core, a wing or another package."""
        if cmd_name in CORE:
            return super().get_command(ctx, cmd_name)
        if wing := wing_of(cmd_name):
            name = cmd_name.replace("-", "_")
            command = from_wing(wing, f"cli.{name}", name, used_by=cmd_name)
            return cast("click.Command", command)
        if cmd_name not in _added():
            return None
        from fpmatch.base.plugins import COMMANDS, load_plugin

        return cast("click.Command", load_plugin(COMMANDS, cmd_name))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the summaries, then those of the wings and the commands of other packages."""
        super().format_commands(ctx, formatter)
        sections = {wing.title: wing.commands for wing in registered().values()}
        known = summaries()
        added = {name: of for name, of in _added().items() if name not in known}
        sections["Commands of other packages"] = added
        for title, commands in sections.items():
            if commands:
                with formatter.section(title):
                    formatter.write_dl(list(commands.items()))

    def make_context(self, *args: Any, **options: Any) -> click.Context:
        """Return the context of a command line; click answers Ctrl-C here with "Aborted!"."""
        try:
            return super().make_context(*args, **options)
        except click.ClickException as error:
            raise _made_printable(error) from None
        except KeyboardInterrupt:
            raise click.exceptions.Exit(EXIT_INTERRUPTED) from None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the sub-command that is named first; note before that other code runs, if so."""
        resolved: tuple[str | None, click.Command | None, list[str]]
        name = click.utils.make_str(args[0])
        known = name in CORE or wing_of(name) is not None
        if not known and name in _added():
            resolved = name, self.get_command(ctx, name), args[1:]
        else:
            resolved = super().resolve_command(ctx, args)
        if not ctx.resilient_parsing:
            from fpmatch.cli.notes import say_other_sources, say_outdated_kernels

            say_other_sources()
            if resolved[0] != "doctor":  # which lists them itself
                say_outdated_kernels()
        return resolved

    def invoke(self, ctx: click.Context) -> Any:
        try:
            self._invoke(ctx)
        except (KeyboardInterrupt, Exception) as error:
            if not is_interrupt(error):
                raise
            ctx.exit(EXIT_INTERRUPTED)

    def _invoke(self, ctx: click.Context) -> None:
        try:
            ctx.exit(super().invoke(ctx) or 0)
        except click.ClickException as error:
            raise _made_printable(error) from None
        except FpmatchError as error:
            raise _OneLineError(str(error)) from error
        except BrokenPipeError:
            # The reader has gone; otherwise the interpreter reports it again when it flushes.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            ctx.exit(EXIT_BROKEN_PIPE)
        except OSError as error:
            # other files raise FpmatchError: this is the output itself, on a full disk
            raise _OneLineError(f"{error.filename or 'output'}: {error.strerror}") from error


def _added() -> dict[str, str]:
    """Return the commands that other packages add, and what each is of."""
    from fpmatch.base.plugins import COMMANDS, plugin_names, plugin_source

    return {name: plugin_source(COMMANDS, name) for name in plugin_names(COMMANDS)}


def _show_version(ctx: click.Context, _: click.Parameter, requested: bool) -> None:
    if requested and not ctx.resilient_parsing:
        from fpmatch.base.kernels import kernels_text
        from fpmatch.cli.notes import say_other_sources, show_line

        say_other_sources()
        show_line(f"fpmatch {__version__} ({kernels_text()})")
        ctx.exit()


@click.group(
    name="fpmatch",
    cls=_Fpmatch,
    summaries=CORE,
    prefix="fpmatch.cli.",
    context_settings={
        "help_option_names": ["-h", "--help"],
        "max_content_width": 100,
        "show_default": True,
        "token_normalize_func": lambda word: word.replace("imposter", "impostor"),
    },
    epilog="""\b
Examples:
  fpmatch verify probe.tif reference.tif
  fpmatch verify probe.tif reference.tif --json --overlay overlay.png
  fpmatch COMMAND --help

Exit status: 0 match or done, 1 no match or some failures, 2 input that cannot be used (with one
line on stderr), 3 inconclusive.
""",
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version and the state of the kernels, and exit.",
)
def fpmatch() -> None:
    """Verify fingerprints: two images in; a decision, its score and the transform out."""
