"""The command ``outputs``: what the commands of README and docs print, as blocks of these pages.

A block of text stands between the comments ``NAME-output:start`` and ``NAME-output:end``, after the
block of shell commands that print it.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import click

from fpmatch.errors import FpmatchError
from research.commands import ROOT, Command
from research.markdown import marked_block, write_marked_block

_MARK: Final = re.compile(r"<!-- ([\w-]+-output):start -->")
_COMMANDS: Final = re.compile(r"^```sh\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_SHOWN_FOLDER: Final = "/home/me"
_TIMES: Final = re.compile(r"\d[\d.,]*(?= (?:s|ms|a second)\b)")


@dataclass(frozen=True, slots=True)
class Output:
    """The place where a page shows the output of commands, and the commands."""

    page: Path
    mark: str
    commands: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT).as_posix()}: {self.mark}"

    @property
    def shown(self) -> str:
        """The output that the page shows."""
        block = marked_block(self.page.read_text(encoding="utf-8"), self.mark) or ""
        return block.removeprefix("```text\n").removesuffix("```")

    def printed(self) -> str:
        """Run the commands beside the sample data, and return what they print."""
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(ROOT / "sample_data", Path(folder, "sample_data"))
            found = "".join(_output_of(command, folder) for command in self.commands)
            return found.replace(str(Path(folder).resolve()), _SHOWN_FOLDER)


def documented_outputs() -> list[Output]:
    """Return all outputs that README and docs show."""
    found = []
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]:
        text = page.read_text(encoding="utf-8")
        for mark in _MARK.finditer(text):
            lines = _COMMANDS.findall(text[: mark.start()])[-1].splitlines()
            commands = [line.partition("#")[0].strip() for line in lines]
            found.append(Output(page, mark[1], tuple(filter(None, commands))))
    return found


def without_times(text: str) -> str:
    """Return text with every time and rate in it replaced by an ellipsis.

    Examples
    --------
    >>> without_times("16 prints compared in 0.02 s (38.2 a second)")
    '16 prints compared in … s (… a second)'
    """
    return _TIMES.sub("…", text)


def _output_of(command: str, folder: str) -> str:
    name, *words = command.split()
    if name != "fpmatch":
        raise FpmatchError(f"{command}: not a command of fpmatch")
    done = subprocess.run(
        [sys.executable, "-m", "fpmatch", *words],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    if done.returncode not in {0, 1}:
        raise FpmatchError(f"{command}: {done.stderr.strip()}")
    return done.stdout


@click.command(cls=Command)
@click.option("--check", is_flag=True, help="Compare the pages with the output; write nothing.")
@click.pass_context
def command(context: click.Context, check: bool) -> None:
    """Write what commands print into README and the pages of the documentation.

    Times are not compared, and written only where the rest differs. --check ends with exit status
    1 where a page differs from the output.
    """
    outdated = 0
    for output in documented_outputs():
        printed = output.printed()
        if without_times(printed) == without_times(output.shown):
            continue
        outdated += 1
        if not check:
            write_marked_block(output.page, output.mark, f"```text\n{printed}```")
        click.echo(f"{output}: {'differs' if check else 'written'}")
    context.exit(1 if check and outdated else 0)
