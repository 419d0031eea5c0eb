"""Make the helper modules beside the tests importable, and the kernels as ordinary Python."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

sys.path.append(str(Path(__file__).parent))

KERNELS = (
    *("align", "amount", "compare", "consistency", "encode", "evidence", "local", "minutia_grid"),
    *("prefilter", "preparation", "relaxation", "ridge", "ridge_search", "template_view"),
)


@pytest.fixture(scope="session")
def plain(interpreted):
    """Return the kernels of matching as ordinary Python, each of which uses the others."""
    found = SimpleNamespace(**{name: interpreted(f"_{name}_kernel") for name in KERNELS})
    with pytest.MonkeyPatch.context() as patch:
        # compiled, this kernel offers the function that the two use to other kernels alone
        name = "fpmatch.pointset.unit_circle._one_ring_kernel"
        patch.setitem(sys.modules, name, interpreted("_one_ring_kernel"))
        found.pair_mesh = interpreted("_pair_mesh_kernel")
        found.neighbourhood = interpreted("_neighbourhood_kernel")
    found.prefilter.PairSet = found.consistency.PairSet
    found.align.MinutiaGrid = found.minutia_grid.MinutiaGrid
    found.align.Relaxation = found.relaxation.Relaxation
    found.align.PairMesh = found.pair_mesh.PairMesh
    found.evidence.RidgeCorrelator = found.ridge.RidgeCorrelator
    found.evidence.RidgeSearch = found.ridge_search.RidgeSearch
    found.evidence.amount = found.amount
    found.compare.smaller_area = found.amount.smaller_area
    found.compare.as_similarity = found.amount.as_similarity
    found.compare.normalize_by_size = found.local.normalize_by_size
    return found
