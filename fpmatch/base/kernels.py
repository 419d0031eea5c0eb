"""Which kernels (modules ``_*_kernel.py``) run compiled, are out of date, and of which copy.

No kernel is imported here.
"""

from __future__ import annotations

import os
import re
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Final

_PACKAGE: Final = Path(__file__).parents[1]
_KERNEL: Final = re.compile(r"_.*_kernel\.py")
_BUILD: Final = Path("scripts", "build")  # of a clone; a copy that is installed has none


def compiled_kernels() -> dict[str, bool]:
    """Return whether each kernel runs compiled, by the name of its module."""
    return {name: compiled is not None for name, (_, compiled) in _times().items()}


def outdated_kernels() -> list[str]:
    """Return the names of the kernels of a clone that are older than their files.

    Where others are compiled, a kernel that is not compiled is one of them, too. A new ``.pxd``
    file renews all.
    """
    times = _times() if (_PACKAGE.parent / _BUILD).exists() else {}
    if not any(compiled for _, compiled in times.values()):
        return []
    return [name for name, (changed, compiled) in times.items() if (compiled or 0) < changed]


def slow_kernels_note() -> str | None:
    """Return the note before long work that kernels are not compiled; None where all are."""
    kernels = compiled_kernels()
    slow = len(kernels) - sum(kernels.values())
    if not slow:
        return None
    return (
        f"{slow} of {len(kernels)} kernels are not compiled: batches take many times as long, with "
        f"the same results; `{build_command()}` compiles them where there is a C compiler"
    )


def other_sources_note() -> str | None:
    """Return a note where the working directory is in a clone with other sources, else None."""
    try:
        here = Path.cwd()
    except OSError:  # it has been removed
        return None
    clones = (one for one in (here, *here.parents) if (one / _BUILD).exists())
    copy = next(clones, here) / "fpmatch"
    if not copy.is_dir() or copy.samefile(_PACKAGE):
        return None
    own, other = (
        {
            path.relative_to(one): path.read_bytes()
            for kind in ("py", "pxd")
            for path in one.rglob(f"*.{kind}")
        }
        for one in (_PACKAGE, copy)
    )
    if own == other:
        return None
    return (
        f"this is the fpmatch of {_PACKAGE.parent}, not that of the clone {copy.parent}, whose "
        "sources differ; `pip install --no-deps --editable .` there installs it"
    )


def build_command() -> str:
    """Return the command that compiles the kernels of this installation."""
    return "scripts/build" if (_PACKAGE.parent / _BUILD).exists() else "pip install ."


def _times() -> dict[str, tuple[int, int | None]]:
    """Return when the files of each kernel were changed, and when it was compiled, if it was.

    Times are whole seconds: setuptools keeps no more where it copies a kernel.
    """
    sources, declared = list[Path](), 0
    for folder, _, names in os.walk(_PACKAGE):  # `Path.rglob` takes several times as long
        for name in names:
            if name.endswith(".pxd"):
                declared = max(declared, int(Path(folder, name).stat().st_mtime))
            elif _KERNEL.fullmatch(name):
                sources.append(Path(folder, name))
    times: dict[str, tuple[int, int | None]] = {}
    for source in sorted(sources):
        changed = max(declared, int(source.stat().st_mtime))
        files = [file for one in EXTENSION_SUFFIXES if (file := source.with_suffix(one)).exists()]
        name = ".".join(source.relative_to(_PACKAGE.parent).with_suffix("").parts)
        times[name] = changed, int(files[0].stat().st_mtime) if files else None
    return times
