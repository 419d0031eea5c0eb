"""Make `matching_prints` importable for the tests beside it, and kernels that use each other."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

sys.path.append(str(Path(__file__).parent))


@pytest.fixture(scope="session")
def interpreted_mesh(interpreted: Callable[[str], ModuleType]) -> ModuleType:
    """Return the kernel of the mesh of pairs as ordinary Python, the weights that it uses also."""
    with pytest.MonkeyPatch.context() as patch:
        # compiled, that kernel shows the function to other kernels alone
        weights = interpreted("_one_ring_kernel")
        patch.setitem(sys.modules, "fpmatch.pointset.unit_circle._one_ring_kernel", weights)
        return interpreted("_pair_mesh_kernel")


@pytest.fixture(scope="session")
def interpreted_aligner(
    interpreted: Callable[[str], ModuleType], interpreted_mesh: ModuleType
) -> ModuleType:
    """Return the alignment kernel as ordinary Python, the kernels that it uses likewise."""
    module = interpreted("_align_kernel")
    module.MinutiaGrid = interpreted("_minutia_grid_kernel").MinutiaGrid
    module.Relaxation = interpreted("_relaxation_kernel").Relaxation
    module.PairMesh = interpreted_mesh.PairMesh
    return module
