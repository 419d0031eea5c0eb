"""The rooms of the package: the import contract that the tests hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.cli.wings import WINGS

if TYPE_CHECKING:
    from collections.abc import Mapping, Set

# A room is a folder, without the folders in it, or a module beside the folders. Each may import the
# rooms that stand here, and what these may import: so no two rooms import each other, and the core
# imports no wing.
MAY_IMPORT: Final[Mapping[str, Set[str]]] = {
    # The core.
    "_version": set(),
    "printable": set(),
    "errors": {"printable"},
    "base": {"errors"},
    "__init__": {"_version", "base"},
    "base/encryption": {"base"},
    "pointset/geometry": {"errors"},
    "templates": {"base"},
    "drawing/scene": {"pointset/geometry", "templates"},
    "matching/numpy_forms": set(),
    "pointset/delaunay": {"pointset/geometry"},
    "pointset/paper": {"base", "pointset/delaunay"},
    "matching/prints/_kernels": {"matching/numpy_forms", "pointset/paper", "templates"},
    "matching/pipeline/_kernels": {"matching/prints/_kernels"},
    "matching/prints": {"matching/prints/_kernels", "templates"},
    "matching/pipeline": {"matching/pipeline/_kernels", "matching/prints"},
    "matching": {"matching/pipeline"},
    "formats": {"base/encryption", "templates"},
    "image/preprocess": set(),
    "image/enhancement": {"base", "image/preprocess"},
    "image/quality": {"image/preprocess", "templates"},
    "image/io": {"image/quality"},
    "formats/agency": {"formats", "image/io"},
    "image/skeleton": {"image/preprocess"},
    "image": {"image/enhancement", "image/io", "image/skeleton"},
    "matching/reference": {"matching/pipeline"},
    "matching/matchers": {"matching", "matching/reference"},
    "prints": {"formats", "image", "matching/matchers"},
    "drawing/overlay": {"drawing/scene", "prints"},
    "drawing": {"_version", "drawing/overlay"},
    "drawing/stages": {"drawing/overlay"},
    "cli": {"drawing", "drawing/stages"},
    "__main__": {"cli"},
    "api": {"drawing/overlay"},
    # The wing of galleries and batches.
    "gallery/engine": {"_version", "base"},
    "gallery/listing": {"gallery/engine", "prints"},
    "gallery/store": {"gallery/listing"},
    "gallery/index/prints": {"gallery/store"},
    "gallery/index": {"gallery/index/prints"},
    "gallery/fingers": {"matching"},
    "gallery": {"gallery/index"},
    "gallery/search": {"gallery", "gallery/fingers"},
    "gallery/batch": {"gallery/search"},
    "gallery/tasks": {"api", "gallery/search"},
    "gallery/cli": {"cli", "gallery/batch", "gallery/tasks"},
    # The wing of the server.
    "server": {"drawing", "drawing/stages", "gallery/tasks"},
    "server/cli": {"gallery/cli", "server"},
    # The wing of the laboratory.
    "lab/evaluation/databases": {"gallery/batch"},
    "lab/evaluation/rates": {"gallery/batch"},
    "lab/plots": {"drawing/scene", "prints"},
    "lab/evaluation/report": {
        "drawing/overlay",
        "lab/evaluation/databases",
        "lab/evaluation/rates",
        "lab/plots",
    },
    "lab/synthesis": {"gallery/engine", "pointset/geometry", "templates"},
    "lab/evaluation": {"lab/evaluation/report", "lab/synthesis"},
    "lab/evaluation/ground_truth": {"lab/evaluation/report", "lab/synthesis"},
    "lab/evaluation/open_set": {"lab/evaluation/report"},
    "lab/points/triangles": {"pointset/delaunay"},
    "lab/points/affine": {"lab/points/triangles"},
    "lab/points/van_wamelen": {"pointset/geometry"},
    "lab/points": {"base", "lab/points/affine", "lab/points/van_wamelen", "pointset/paper"},
    "lab/explain": {"_version", "drawing/overlay", "lab/plots", "matching/reference"},
    "lab/cli": {
        "gallery/cli",
        "lab/evaluation",
        "lab/evaluation/ground_truth",
        "lab/evaluation/open_set",
        "lab/explain",
        "lab/points",
    },
}


def allowed(room: str) -> set[str]:
    """Return every room that `room` may import, directly or by way of another."""
    return {room}.union(*map(allowed, MAY_IMPORT[room]))


def wing_of(room: str) -> str:
    """Return the wing of a room, "core" for those of the core."""
    part = room.partition("/")[0]
    return part if part in WINGS else "core"
