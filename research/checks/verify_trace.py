"""The command ``check trace``: what one bare verification loads and runs, where all is compiled.

A climb is a call from a file to one in a room (a folder, or a module beside the folders) that may
import the caller's, by the import contract: to a matcher or a recorder that was handed down, or to
a module that loads where it is used. A property that is read of a value is not a call.
"""

from __future__ import annotations

import inspect
import sys
import tempfile
from collections import Counter
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

import fpmatch
from research.commands import Command
from research.rooms import allowed

if TYPE_CHECKING:
    from types import FrameType

PACKAGE: Final = Path(fpmatch.__file__).parent
_COMPREHENSIONS: Final = ("<genexpr>", "<listcomp>", "<dictcomp>", "<setcomp>", "<lambda>")


class Trace:
    """The functions of the package that run, and the calls from one file to another."""

    def __init__(self) -> None:
        self.functions: Counter[tuple[str, str]] = Counter()
        self.calls: Counter[tuple[str, str]] = Counter()

    def __call__(self, frame: FrameType, event: str, _: Any) -> None:
        """Note a call, as `sys.setprofile` reports it."""
        if event != "call" or (file := _file_of(frame)) is None:
            return
        if not frame.f_code.co_flags & inspect.CO_OPTIMIZED:  # a module or a class is defined
            return
        if (name := frame.f_code.co_qualname).endswith(_COMPREHENSIONS):
            return
        self.functions[file, name] += 1
        caller = frame.f_back
        while caller is not None and _file_of(caller) is None:
            caller = caller.f_back
        if caller is not None and (origin := _file_of(caller)) != file and not _is_read(frame):
            self.calls[str(origin), file] += 1


def _is_read(frame: FrameType) -> bool:
    """Return whether a frame computes a property of a value."""
    owner, name = type(frame.f_locals.get("self")), frame.f_code.co_name
    return isinstance(inspect.getattr_static(owner, name, None), property | cached_property)


def _file_of(frame: FrameType) -> str | None:
    """Return the file of a frame in the package; None for another."""
    path = Path(frame.f_code.co_filename)
    return path.relative_to(PACKAGE).as_posix() if PACKAGE in path.parents else None


def room_of(file: str) -> str:
    """Return the room of a file: its folder, or the module itself beside the folders."""
    return file.rpartition("/")[0] or file.removesuffix(".py")


def is_climb(origin: str, file: str) -> bool:
    """Return whether a call from one file to another goes up: to a room that stands on its own."""
    lower, upper = room_of(origin), room_of(file)
    return lower != upper and lower in allowed(upper)


def loaded_lines() -> int:
    """Return the lines of the modules of the package that are loaded, kernels among them."""
    sources = (
        Path(str(module.__file__)) for name, module in sys.modules.items() if _is_loaded(name)
    )
    files = {path.with_name(f"{path.name.partition('.')[0]}.py") for path in sources}
    files = {path for path in files if path.exists()}  # what Cython's kernels share has none
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files)


def _is_loaded(name: str) -> bool:
    module = sys.modules[name]
    return name.partition(".")[0] == "fpmatch" and getattr(module, "__file__", None) is not None


@click.command(cls=Command)
@click.argument("probe", type=click.Path(exists=True))
@click.argument("reference", type=click.Path(exists=True))
def command(probe: str, reference: str) -> None:
    """Count what ``fpmatch verify PROBE REFERENCE --overlay`` loads and runs.

    The counts are of lines loaded, of files and functions that ran, and of calls that climb.
    """
    trace = Trace()
    with tempfile.TemporaryDirectory() as folder:
        words = ["verify", probe, reference, "--overlay", str(Path(folder, "overlay.png"))]
        sys.setprofile(trace)
        try:
            from fpmatch.cli import main  # noqa: PLC0415  (part of what is traced)

            main(words)
        except SystemExit:
            pass
        finally:
            sys.setprofile(None)
    climbs = [(a, b) for a, b in trace.calls if is_climb(a, b)]
    files = len({file for file, _ in trace.functions})
    click.echo(
        f"{loaded_lines()} lines loaded, {files} files and {len(trace.functions)} functions run, "
        f"{len(climbs)} climbs:"
    )
    for origin, file in sorted(climbs):
        click.echo(f"  {origin} -> {file}")
