"""The command ``fpmatch`` itself: it finds sub-commands when asked and words their errors."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import IO, Any, Final, cast

import click

from fpmatch._version import __version__
from fpmatch.errors import FpmatchError

# Each sub-command is the object of its own name in the module of its own name; its module is
# imported when it runs, so that `fpmatch --help` imports none of them.
SUMMARIES: Final = {
    "verify": "Decide whether two images show the same finger.",
    "overlay": "Draw one print, moved, over another.",
    "extract": "Write the templates of images as files.",
    "stages": "Write every stage of an extraction as a picture.",
    "evaluate": "Measure error rates on FVC-style databases.",
}
EXIT_ERROR: Final = 2
EXIT_INTERRUPTED: Final = 130  # 128 + SIGINT, as shells report it
EXIT_BROKEN_PIPE: Final = 141  # 128 + SIGPIPE


class _OneLineError(click.ClickException):
    """An error shown as one line on stderr, with exit status 2."""

    exit_code = EXIT_ERROR

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the line."""
        line = " ".join(self.format_message().split())
        click.echo(f"fpmatch: error: {line}", file=file, err=True)


class _LazyGroup(click.Group):
    """Import a sub-command when it is called for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(SUMMARIES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in SUMMARIES:
            return None
        command = getattr(import_module(f"fpmatch.cli.{cmd_name}"), cmd_name)
        return cast("click.Command", command)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(SUMMARIES.items()))

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except FpmatchError as error:
            raise _OneLineError(str(error)) from error
        except KeyboardInterrupt:
            ctx.exit(EXIT_INTERRUPTED)
        except BrokenPipeError:
            # The reader has gone; the interpreter would complain once more when it flushes.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            ctx.exit(EXIT_BROKEN_PIPE)


@click.group(
    name="fpmatch",
    cls=_LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  fpmatch verify probe.tif reference.tif
  fpmatch verify probe.tif reference.tif --json --overlay overlay.png
  fpmatch extract prints/*.tif -o templates
  fpmatch COMMAND --help

Exit status: 0 match or done, 1 no match, 2 could not decide (bad input, with one line on stderr).
""",
)
@click.version_option(__version__, prog_name="fpmatch", message="%(prog)s %(version)s")
def fpmatch() -> None:
    """Verify fingerprints: two images in; a decision, its certainty and the transform out."""
