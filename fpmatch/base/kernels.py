"""Which kernels (modules ``_*_kernel.py``) run compiled, are out of date, and of which copy.

No kernel is imported here.
"""

from __future__ import annotations

import os
import re
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Final, NamedTuple

_PACKAGE: Final = Path(__file__).parents[1]
_KERNEL: Final = re.compile(r"_.*_kernel\.py")


class _Kernel(NamedTuple):
    source: str
    compiled: str | None  # the file that is loaded, if it is compiled


def compiled_kernels() -> dict[str, bool]:
    """Return whether each kernel runs compiled, by the name of its module."""
    return {name: one.compiled is not None for name, one in _files()[0].items()}


def outdated_kernels() -> list[str]:
    """Return the names of the kernels of a source tree that are older than their files.

    Where others are compiled, a kernel that is not compiled is one of them, too. A new ``.pxd``
    file renews all. Times are whole seconds: setuptools keeps no more where it copies a kernel.
    """
    if not _is_clone(_PACKAGE.parent):
        return []
    kernels, declarations = _files()
    if not any(one.compiled for one in kernels.values()):
        return []
    declared = max((int(Path(file).stat().st_mtime) for file in declarations), default=0)
    return [
        name
        for name, (source, compiled) in kernels.items()
        if compiled is None
        or int(Path(compiled).stat().st_mtime) < max(declared, int(Path(source).stat().st_mtime))
    ]


def other_sources_note() -> str | None:
    """Return a note where the working directory is in a clone with other sources, else None.

    There is none in the clone of this package, or in one with the same sources.
    """
    clone = _clone_here()
    if clone is None or _same_sources(clone / _PACKAGE.name):
        return None
    return (
        f"this is the fpmatch of {_PACKAGE.parent}, not that of the clone {clone}, whose sources "
        f"differ; `{build_command(clone)}` there installs it"
    )


def kernels_text() -> str:
    """Return on one line how many kernels run compiled."""
    kernels, outdated = compiled_kernels(), len(outdated_kernels())
    compiled = sum(kernels.values())
    if outdated:
        mended = f"`{build_command()}` compiles them"
        return f"{outdated} of {len(kernels)} kernels out of date: {mended}"
    if compiled == len(kernels):
        return "kernels compiled"
    if compiled == 0:
        return "kernels not compiled: slow"
    return f"only {compiled} of {len(kernels)} kernels compiled: slow"


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


def build_command(clone: Path | None = None) -> str:
    """Return the command that compiles the kernels of this installation, or of a clone."""
    source = clone or (_PACKAGE.parent if _is_clone(_PACKAGE.parent) else _clone_here())
    if source is None:
        return "pip install ."
    own = Path(sys.prefix).resolve() == (source / ".venv").resolve()
    return "scripts/build" if own else "pip install --no-deps --editable ."


def _is_clone(folder: Path) -> bool:
    return (folder / "scripts" / "build").exists() and (folder / _PACKAGE.name).is_dir()


def _clone_here() -> Path | None:
    """Return the clone that the working directory is in; None for that of this package."""
    try:
        here = Path.cwd()
    except OSError:  # it has been removed
        return None
    clone = next(filter(_is_clone, (here, *here.parents)), None)
    return None if clone is None or (clone / _PACKAGE.name).samefile(_PACKAGE) else clone


def _same_sources(package: Path) -> bool:
    """Return whether another copy of the package has the same files of Python and Cython."""
    from filecmp import cmp  # noqa: PLC0415  (only in a clone)

    here, there = (
        {path.relative_to(one) for kind in ("py", "pxd") for path in one.rglob(f"*.{kind}")}
        for one in (_PACKAGE, package)
    )
    return here == there and all(cmp(_PACKAGE / one, package / one, shallow=False) for one in here)


def _files() -> tuple[dict[str, _Kernel], list[str]]:
    """Return the files of each kernel, by its module's name, and all ``.pxd`` files."""
    kernels: dict[str, _Kernel] = {}
    declarations: list[str] = []
    for folder, folders, names in os.walk(_PACKAGE):  # `Path.rglob` takes several times as long
        folders[:] = [one for one in folders if one != "__pycache__"]
        declarations += [f"{folder}{os.sep}{name}" for name in names if name.endswith(".pxd")]
        prefix = f"{_PACKAGE.name}{folder[len(str(_PACKAGE)) :]}".replace(os.sep, ".")
        for kernel in (name[:-3] for name in names if _KERNEL.fullmatch(name)):
            place = f"{folder}{os.sep}{kernel}"
            files = (suffix for suffix in EXTENSION_SUFFIXES if kernel + suffix in names)
            suffix = next(files, None)
            kernels[f"{prefix}.{kernel}"] = _Kernel(f"{place}.py", suffix and place + suffix)
    return dict(sorted(kernels.items())), declarations
