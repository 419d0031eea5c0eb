"""The command ``check trace``: what one bare verification loads and runs, where all is compiled.

A module's floor is the number of modules that it stands on, at most, by the imports at its head. A
climb is a call from a file to one on a higher floor: to a page, a matcher or a recorder that was
handed down, and to modules that load where they are used.
"""

from __future__ import annotations

import ast
import inspect
import sys
import tempfile
from collections import Counter
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

import fpmatch
from research.commands import Command

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
        if caller is not None and (origin := _file_of(caller)) != file:
            self.calls[str(origin), file] += 1


def _file_of(frame: FrameType) -> str | None:
    """Return the file of a frame in the package; None for another."""
    path = Path(frame.f_code.co_filename)
    return path.relative_to(PACKAGE).as_posix() if PACKAGE in path.parents else None


@cache
def floor(file: str) -> int:
    """Return on how many modules, at most, a module stands."""
    tree = ast.parse((PACKAGE / file).read_text(encoding="utf-8"))
    under = set()
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("fpmatch"):
            modules = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            files = [f"{'/'.join(module.split('.')[1:])}.py" for module in modules]
            under |= {one for one in files if (PACKAGE / one).is_file()} - {file}
    return 1 + max(map(floor, under), default=-1)


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
    climbs = [(a, b) for a, b in trace.calls if floor(b) > floor(a)]
    files = len({file for file, _ in trace.functions})
    click.echo(
        f"{loaded_lines()} lines loaded, {files} files and {len(trace.functions)} functions run, "
        f"{len(climbs)} climbs:"
    )
    for origin, file in sorted(climbs):
        click.echo(f"  {origin} ({floor(origin)}) -> {file} ({floor(file)})")
