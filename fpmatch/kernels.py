"""Which inner loops, the modules ``_*_kernel.py``, run compiled, without importing any."""

from __future__ import annotations

from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Final

# Times the CPU time of `fpmatch evaluate` if no kernel is compiled; docs/data/performance.json has
# it as measured.
SLOWER: Final = 9


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


def slow_kernels_note() -> str | None:
    """Return what long work notes first where kernels do not run compiled; None where all do."""
    kernels = compiled_kernels()
    slow = len(kernels) - sum(kernels.values())
    if not slow:
        return None
    return (
        f"{slow} of {len(kernels)} kernels are not compiled: batches take up to {SLOWER} times as "
        "long, with the same results; `pip install .` compiles them where there is a C compiler"
    )
