"""The command ``fpmatch``: it imports sub-commands when they run and prints their errors."""

from __future__ import annotations

import os
import sys
from typing import IO, Any, Final

import click

from fpmatch._version import __version__
from fpmatch.cli import EXIT_INTERRUPTED, is_interrupt
from fpmatch.cli.command import Group
from fpmatch.errors import FpmatchError
from fpmatch.printable import message_text

# All commands, by the title of their section and the folder of the package that has them; the
# folders after the first are wings. The command NAME is the object NAME of FOLDER.NAME.
COMMANDS: Final = {
    ("Commands", "cli"): {
        "verify": "Decide whether two images show the same finger.",
        "extract": "Write templates of images, or each stage as a picture.",
        "convert": "Write a template in another format: ISO, ANSI, NIST, JSON, CSV.",
        "inspect": "Show what files contain: format, size, minutiae, quality.",
        "doctor": "Show what is installed: versions, kernels, extras, plug-ins.",
    },
    ("Galleries and batches", "gallery.cli"): {
        "enrol": "Enrol prints in a gallery, a database of templates.",
        "identify": "Rank the subjects of a gallery by how well they match a probe.",
        "gallery": "Show and change a gallery: list, check, remove, rewrite.",
        "key": "List and make the keys of encrypted galleries.",
        "score": "Compare all probes with all references, scores into a file.",
    },
    ("Server", "server.cli"): {
        "serve": "Serve a web interface to compare prints, and an HTTP API.",
    },
    ("Laboratory", "lab.cli"): {
        "explain": "Show each step of the method on two prints.",
        "evaluate": "Measure error rates on databases of prints.",
        "evaluate-identification": "Measure error rates of searches (1:N).",
        "rates": "Compute error rates of scores of any matcher.",
        "synth": "Make synthetic prints with ground truth.",
        "calibrate": "Fit scores to the rates of your own prints.",
        "points": "Find the transform between two point sets.",
    },
}

EXIT_ERROR: Final = 2
EXIT_BROKEN_PIPE: Final = 141  # 128 + SIGPIPE


class _OneLineError(click.ClickException):
    """An error shown as one line on stderr, with exit status 2."""

    exit_code = EXIT_ERROR

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the line."""
        from fpmatch.cli.notes import say

        say(f"error: {self.format_message()}")


def _shown(error: Exception) -> Exception:
    """Return an error as it is shown: of a command line with its usage, of input on one line."""
    if isinstance(error, click.ClickException):
        error.message = message_text(error.message)  # type: ignore[misc]  # it repeats the words
        return error
    if isinstance(error, OSError):
        # other files raise FpmatchError: this is the output itself, on a full disk
        return _OneLineError(message_text(f"{error.filename or 'output'}: {error.strerror}"))
    return _OneLineError(message_text(error))


def _places() -> dict[str, str]:
    return {
        name: f"fpmatch.{folder}.{name.replace('-', '_')}:{name.replace('-', '_')}"
        for (_, folder), commands in COMMANDS.items()
        for name in commands
    }


class _Fpmatch(Group):
    """The whole command: sub-commands return the exit status, errors are shown on one line."""

    def sections(self, ctx: click.Context) -> dict[str, dict[str, str]]:
        """Return the summaries, without importing the commands."""
        return {title: commands for (title, _), commands in COMMANDS.items()}

    def make_context(self, *args: Any, **options: Any) -> click.Context:
        """Return the context of a command line; click answers Ctrl-C here with "Aborted!"."""
        try:
            return super().make_context(*args, **options)
        except click.ClickException as error:
            raise _shown(error) from None
        except KeyboardInterrupt:
            raise click.exceptions.Exit(EXIT_INTERRUPTED) from None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the sub-command that is named first; note before that other code runs, if so."""
        resolved = super().resolve_command(ctx, args)
        if not ctx.resilient_parsing:
            from fpmatch.cli.notes import say_kernels

            say_kernels(outdated=resolved[0] != "doctor")  # which lists them itself
        return resolved

    def invoke(self, ctx: click.Context) -> Any:
        """Run a sub-command and exit with its status."""
        try:
            ctx.exit(super().invoke(ctx) or 0)
        except BrokenPipeError:
            # The reader has gone; otherwise the interpreter reports it again when it flushes.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            ctx.exit(EXIT_BROKEN_PIPE)
        except (KeyboardInterrupt, Exception) as error:
            if is_interrupt(error):
                ctx.exit(EXIT_INTERRUPTED)
            if isinstance(error, click.ClickException | FpmatchError | OSError):
                raise _shown(error) from None
            raise


def _show_version(ctx: click.Context, _: click.Parameter, requested: bool) -> None:
    if requested and not ctx.resilient_parsing:
        from fpmatch.base.kernels import kernels_text
        from fpmatch.cli.notes import say_kernels, show_line

        say_kernels(outdated=False)
        show_line(f"fpmatch {__version__} ({kernels_text()})")
        ctx.exit()


@click.group(
    name="fpmatch",
    cls=_Fpmatch,
    lazy=_places(),
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
