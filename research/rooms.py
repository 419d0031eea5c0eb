"""The rooms of the package: the import contract that the tests hold, and the table made from it."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Final

from fpmatch.base.text_table import markdown_table
from research.commands import ROOT

if TYPE_CHECKING:
    from collections.abc import Mapping, Set
    from pathlib import Path

# What each room may import of the others; `allowed` adds what most may.
MAY_IMPORT: Final[Mapping[str, Set[str]]] = {
    "_version": set(),
    "errors": {"base"},
    "base": set(),
    "minutiae": {"ridge_field"},
    "ridge_field": set(),
    "pointset": set(),
    "encryption": set(),
    "image": set(),
    "matching": {"stored_columns", "stored_template", "pointset"},
    "stored_columns": {"_template_column_kernel", "formats", "stored_template"},
    "stored_template": {"_template_column_kernel", "formats"},
    "_template_column_kernel": set(),
    "formats": {"encryption"},
    "drawing": {"prints"},
    "indexing": {"matching", "pointset"},
    "engine": set(),
    "synthesis": {"pointset", "engine"},
    "prints": {"formats", "image", "matching", "pointset"},
    "gallery": {"audit", "encryption", "engine", "formats", "image", "indexing", "prints"},
    "evaluation": {"image", "matching", "drawing", "engine", "gallery", "synthesis"},
    "audit": set(),
    "api": {"drawing", "image", "matching", "prints"},
    "gallery_api": {"api", "engine", "gallery"},
    "client": {"formats"},
    "web": {"audit", "drawing", "engine", "gallery", "prints"},
    "cli": {"evaluation", "prints", "synthesis", "web"},
    "__main__": {"cli"},
}
# Rooms that may not import `minutiae`.
NO_MINUTIAE: Final = {"_version", "base", "encryption", "errors", "pointset", "ridge_field"}


def allowed(room: str) -> set[str]:
    """Return every room that `room` may import, directly or by way of another."""
    rooms = {room, "_version", "base", "errors"}
    if room not in NO_MINUTIAE:
        rooms |= {"minutiae", "ridge_field"}
    for other in MAY_IMPORT[room] - {"base"}:
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
