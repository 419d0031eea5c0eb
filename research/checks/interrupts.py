"""The command ``check interrupts``: Ctrl-C at many moments of every command that takes time.

Each command is started anew for each moment, in a session of its own, and sent SIGINT: the whole
process group, as a terminal does, and its first process alone, as a supervisor does. It must end
with the exit status of an interrupt, print no traceback, and leave no process behind.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import click
import numpy as np

from fpmatch.cli import EXIT_INTERRUPTED
from research.commands import ROOT, Command

SAMPLES: Final = ROOT / "sample_data"
GALLERY: Final = "prints.db"
ENDS_S: Final = 20.0
"""Time limit for a command to end after the interrupt."""
_START_UP: Final = ("Fatal Python error: init_import_site", "in _get_module_details")
"""What Python prints of an interrupt before it runs the program, which cannot prevent it."""
DONE_S: Final = 0.5
"""Time in which a command ends that has printed its result when the interrupt comes."""
LEFT_S: Final = 3.0
"""Time limit for its processes to end after it."""
PRINTS: Final = [f"sample_data/{path.name}" for path in sorted(SAMPLES.glob("*.tif"))]
COMMANDS: Final = {
    "score": ("--references", "sample_data", "--probes", "sample_data", "-o", "scores.csv"),
    "evaluate": ("sample_data",),
    "enrol": ("new.db", "sample_data"),
    "identify": (GALLERY, "sample_data"),
    "serve": ("--port", "0", "--gallery", GALLERY),
    "points bench": ("--quick", "--workers", "2"),
    "extract": (
        *(f"sample_data/{k}_{n}.tif" for k in range(101, 105) for n in range(1, 5)),
        "-o",
        "templates",
    ),
}
STOPPED: Final = frozenset({"serve"})  # their usual end, with exit status 0


@dataclass(frozen=True, slots=True)
class Interrupted:
    """The end of a command that was interrupted after some seconds."""

    command: str
    group: bool
    after_s: float
    status: int
    output: str
    errors: str
    left: int
    ended_s: float

    @property
    def fault(self) -> str:
        """What is wrong, or nothing."""
        right = {EXIT_INTERRUPTED, -signal.SIGINT} | ({0} if self.command in STOPPED else set())
        if any(words in self.errors for words in _START_UP):
            return ""
        if "Traceback" in self.errors or "Exception ignored" in self.errors:
            return "traceback"
        if self.left:
            return f"{self.left} processes left"
        if self.status == 0 and self.output and self.ended_s < DONE_S:
            return ""  # it was done
        return "" if self.status in right else f"exit status {self.status}"


def interrupt(command: str, after_s: float, folder: Path, *, group: bool) -> Interrupted | None:
    """Start a command in a folder and interrupt it; None if it has ended before."""
    process = subprocess.Popen(
        [sys.executable, "-m", "fpmatch", *command.split(), *COMMANDS[command]],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    with process:
        try:
            process.wait(after_s)
        except subprocess.TimeoutExpired:
            pass
        else:
            return None
        (os.killpg if group else os.kill)(process.pid, signal.SIGINT)
        start = time.monotonic()
        with suppress(subprocess.TimeoutExpired):
            process.wait(ENDS_S)
        ended_s = time.monotonic() - start
        status = process.poll()
        left = _left_of(process.pid) if status is not None else []
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        output, errors = (data.decode(errors="replace") for data in process.communicate())
    unended = 999 if status is None else status
    return Interrupted(command, group, after_s, unended, output, errors, len(left), ended_s)


def _left_of(session: int) -> list[int]:
    """Return the processes of a session that are still there after a while."""
    end = time.monotonic() + LEFT_S
    while (found := _processes_of(session)) and time.monotonic() < end:
        time.sleep(0.05)
    return found


def _processes_of(session: int) -> list[int]:
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            fields = status.read_text().rpartition(")")[2].split()
            if int(fields[3]) == session and fields[0] != "Z":
                found.append(int(status.parent.name))
    return found


@click.command(cls=Command)
@click.option("--moments", default=40, show_default=True, help="Moments of each command.")
@click.option(
    "--until", default=4.0, show_default=True, help="Seconds after the start of the last."
)
@click.option("--command", "names", multiple=True, type=click.Choice(list(COMMANDS)))
@click.option("--show", is_flag=True, help="Print what a command with a fault wrote to stderr.")
@click.pass_context
def command(
    context: click.Context, moments: int, until: float, names: tuple[str, ...], show: bool
) -> None:
    """Check that commands heed Ctrl-C whenever it comes (Linux).

    Each must end with the exit status of an interrupt, print no traceback and leave no process
    behind; otherwise the exit status is 1.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in a background job
    faults = 0
    with tempfile.TemporaryDirectory() as made:
        whole = Path(made, "whole")
        shutil.copytree(SAMPLES, whole / "sample_data")
        enrol = [sys.executable, "-m", "fpmatch", "enrol", GALLERY, "sample_data"]
        subprocess.run(enrol, cwd=whole, env=os.environ | {"PYTHONPATH": str(ROOT)}, check=True)
        for name in names or COMMANDS:
            found: list[Interrupted] = []
            for number, after_s in enumerate(np.linspace(0.0, until, moments).tolist()):
                folder = Path(made, "once")
                shutil.copytree(whole, folder)
                one = interrupt(name, after_s, folder, group=number % 2 == 0)
                shutil.rmtree(folder)
                if one is None:
                    break
                found.append(one)
                if one.fault:
                    faults += 1
                    who = "group" if one.group else "first process"
                    click.echo(
                        f"{name} at {after_s:.2f} s, {who}: {one.fault} after {one.ended_s:.2f} s"
                    )
                    if show:
                        click.echo(one.errors)
            slowest = max((one.ended_s for one in found), default=0.0)
            click.echo(f"{name:<10} {len(found):>3} interrupts, ended within {slowest:.1f} s")
    context.exit(1 if faults else 0)
