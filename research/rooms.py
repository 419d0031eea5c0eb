"""The rooms of the package: the import contract that the tests hold, and the table made from it."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Final

from fpmatch.cli.wings import WINGS
from research.commands import ROOT
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Set
    from pathlib import Path

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
    "matching/constants": set(),
    "pointset/delaunay": {"pointset/geometry"},
    "pointset/paper": {"base", "pointset/delaunay"},
    "matching/prints/_kernels": {"matching/constants", "pointset/paper", "templates"},
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


def part_of(room: str) -> str:
    """Return the folder of the package, or the module, that a room is or lies in."""
    return room.partition("/")[0]


def wing_of(room: str) -> str:
    """Return the wing of a room, "core" for those of the core."""
    return part_of(room) if part_of(room) in WINGS else "core"


def _place(part: str) -> Path:
    folder = ROOT / "fpmatch" / part
    return folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")


def task_of(part: str) -> str:
    """Return the first line of the docstring of a folder or module, without its full stop."""
    text = ast.get_docstring(ast.parse(_place(part).read_text(encoding="utf-8"))) or ""
    return text.partition("\n")[0].removesuffix(".").replace("``", "`")


def format_rooms() -> str:
    """Return the table of the folders of the package: what each does, and what it imports."""
    rows = []
    for part in dict.fromkeys(map(part_of, MAY_IMPORT)):
        if not part.startswith("_"):
            used = set().union(*(MAY_IMPORT[room] for room in MAY_IMPORT if part_of(room) == part))
            named = sorted({f"`{part_of(room)}`" for room in used} - {f"`{part}`", "`_version`"})
            is_folder = _place(part).stem == "__init__"
            name = f"`{part}{'/' if is_folder else '.py'}`"
            rows.append([name, wing_of(part), task_of(part), ", ".join(named)])
    return markdown_table([["folder", "wing", "task", "imports"], *rows], left=4)
