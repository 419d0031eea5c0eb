"""The rooms of the package: the import contract that the tests hold, and the table made from it."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Final

from fpmatch.base.text_table import markdown_table
from research.commands import ROOT

if TYPE_CHECKING:
    from collections.abc import Mapping, Set
    from pathlib import Path

# What each room may import of the others; see `allowed` for what most may import besides.
MAY_IMPORT: Final[Mapping[str, Set[str]]] = {
    "_version": set(),
    "errors": set(),
    "templates": {"binary_records"},
    "output": set(),
    "text_table": set(),
    "printable": set(),
    "parsing": set(),
    "npy": set(),
    "array_file": {"output", "parsing"},
    "plugins": set(),
    "kernels": set(),
    "installation": {"engine", "formats", "kernels", "matching", "plugins"},
    "pointset": {"npy"},
    "binary_records": set(),
    "encryption": {"output"},
    "image": {"binary_records"},
    "matching": {"array_file", "plugins", "pointset"},
    "fingers": {"matching"},
    "formats": {"binary_records", "encryption", "npy", "plugins"},
    "drawing": {"matching"},
    "indexing": {"array_file", "matching", "parsing", "pointset"},
    "engine": set(),
    "synthesis": {"pointset", "engine"},
    "reading": {"formats", "image"},
    "pair": {"matching", "reading", "report"},
    "gallery": {
        "audit",
        "encryption",
        "engine",
        "fingers",
        "formats",
        "image",
        "indexing",
        "reading",
    },
    "evaluation": {"image", "fingers", "drawing", "engine", "gallery", "synthesis"},
    "report": {"matching", "drawing", "image", "pointset"},
    "audit": {"output"},
    "case_report": {"drawing", "matching", "pair", "reading", "report"},
    "api": {"drawing", "image", "matching", "pair", "reading", "report"},
    "gallery_api": {"api", "engine", "gallery"},
    "client": {"formats", "output"},
    "web": {"audit", "case_report", "engine", "gallery", "pair"},
    "cli": {"evaluation", "installation", "kernels", "synthesis", "report", "web"},
    "__main__": {"cli"},
}
# Rooms that may not import `templates`.
NO_TEMPLATES: Final = {
    *("_version", "errors", "printable", "output", "binary_records", "npy", "pointset"),
    *("array_file", "encryption"),
}
WRITES_FILES: Final = {"matching", "formats", "drawing", "evaluation", "synthesis", "cli"}


def allowed(room: str) -> set[str]:
    """Return every room that `room` may import, directly or by way of another."""
    rooms = {room, "_version", "errors", "parsing", "printable", "text_table"}
    if room not in NO_TEMPLATES:
        rooms |= {"templates"} | MAY_IMPORT["templates"]
    if room in WRITES_FILES:
        rooms.add("output")
    for other in MAY_IMPORT[room]:
        rooms |= allowed(other)
    return rooms


def _place(room: str) -> Path:
    folder = ROOT / "fpmatch" / room
    return folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")


def task_of(room: str) -> str:
    """Return the first line of a room's docstring, without its full stop."""
    text = ast.get_docstring(ast.parse(_place(room).read_text(encoding="utf-8"))) or ""
    return text.partition("\n")[0].removesuffix(".").replace("``", "`")


def format_rooms() -> str:
    """Return the table of rooms, folders first: what each does, and what it may import."""
    folders: list[list[str]] = []
    modules: list[list[str]] = []
    for room, others in MAY_IMPORT.items():
        if not room.startswith("_"):
            is_folder = _place(room).stem == "__init__"
            named = [f"`{other}`" for other in sorted(others) if not other.startswith("_")]
            row = [f"`{room}{'/' if is_folder else '.py'}`", task_of(room), ", ".join(named)]
            (folders if is_folder else modules).append(row)
    return markdown_table([["room", "task", "may import"], *folders, *modules], left=3)
