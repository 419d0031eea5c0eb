"""Which inner loops, the modules ``_*_kernel.py``, run compiled, without importing any."""

from __future__ import annotations

from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path


def compiled_kernels() -> dict[str, bool]:
    """Return whether each kernel runs compiled, by the name of its module.

    Examples
    --------
    >>> "fpmatch.matching._local_kernel" in compiled_kernels()
    True
    """
    package = Path(__file__).parent
    return {
        ".".join((package.name, *file.relative_to(package).with_suffix("").parts)): any(
            file.with_suffix(suffix).exists() for suffix in EXTENSION_SUFFIXES
        )
        for file in sorted(package.rglob("_*_kernel.py"))
    }


def kernels_text() -> str:
    """Return on one line how many kernels run compiled."""
    kernels = compiled_kernels()
    compiled = sum(kernels.values())
    if compiled == len(kernels):
        return "kernels compiled"
    if compiled == 0:
        return "kernels not compiled: slow"
    return f"only {compiled} of {len(kernels)} kernels compiled: slow"
