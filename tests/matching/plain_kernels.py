"""The kernels of matching as ordinary Python."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import fpmatch

KERNELS = [path.stem for path in (Path(fpmatch.__file__).parent / "matching").rglob("_*_kernel.py")]


def plain_kernels(interpreted):
    """Return the kernels of matching, each of which uses the others; `interpreted` loads one."""
    with pytest.MonkeyPatch.context() as patch:
        # compiled, this kernel offers the function that two kernels use to other kernels alone
        name = "fpmatch.pointset.paper._one_ring_kernel"
        patch.setitem(sys.modules, name, interpreted("_one_ring_kernel"))
        modules = {name[1:].removesuffix("_kernel"): interpreted(name) for name in KERNELS}
    found = SimpleNamespace(**modules)
    found.prefilter.PairSet = found.consistency.PairSet
    found.ridge.smaller_area = found.amount.smaller_area
    return found
