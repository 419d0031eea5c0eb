"""Draw, from the running code, one verification as its calls, and the rooms by their imports."""

from __future__ import annotations

import ast
import inspect
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from xml.sax.saxutils import escape

import fpmatch
from fpmatch import extract, read_image, save_overlay, verify

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

PACKAGE: Final = Path(fpmatch.__file__).parent
DEEPEST: Final = 3  # levels of calls that are drawn
UNSHOWN: Final = (
    *("base/output.py", "errors.py", "image/preprocess/arrays.py"),
    *("templates/minutiae.py", "templates/ridge_field.py"),
)
ROW_PX: Final = 22
INDENT_PX: Final = 30
COLOURS: Final = {
    "image": "#cfe3f5",
    "matching": "#fbe0c3",
    "pointset": "#d8ecd2",
    "drawing": "#e6daf0",
}
_STYLE: Final = "font-family:sans-serif;font-size:13px"


@dataclass(slots=True)
class Call:
    """One function of the walk: where it is, how deep, how often called, and its kernels."""

    name: str
    file: str
    depth: int
    kernels: tuple[str, ...]
    count: int = 1

    @property
    def room(self) -> str:
        """Sub-package of the function."""
        return self.file.partition("/")[0]


def verify_files(probe: Path, reference: Path, overlay: Path) -> None:
    """Verify two images as the README does, and draw the overlay."""
    images = read_image(probe), read_image(reference)
    result = verify(extract(images[0]), extract(images[1]))
    save_overlay(overlay, *images, result)


def trace(work: Callable[[], None]) -> list[Call]:
    """Run `work`; return the public functions of the package that it calls, in order.

    Calls of the same function at the same place are counted once. Functions that start with an
    underscore are left out; what they call takes their place.
    """
    found: dict[tuple[str, ...], Call] = {}
    stack: list[tuple[FrameType, tuple[str, ...]]] = []

    def profile(frame: FrameType, event: str, _: Any) -> None:
        if event == "return" and stack and stack[-1][0] is frame:
            stack.pop()
        path = Path(frame.f_code.co_filename)
        if event != "call" or PACKAGE not in path.parents:
            return
        name, file = frame.f_code.co_qualname, path.relative_to(PACKAGE).as_posix()
        hidden = any(part.startswith(("_", "<")) for part in name.split("."))
        flags = frame.f_code.co_flags
        defines = not flags & inspect.CO_OPTIMIZED  # the body of a class, when it is imported
        generator = flags & inspect.CO_GENERATOR  # resumed, not called again
        if (
            hidden
            or defines
            or generator
            or file in UNSHOWN
            or file.endswith("_kernel.py")
            or is_property(frame)
        ):
            return
        place = (*(stack[-1][1] if stack else ()), f"{file}:{name}")
        stack.append((frame, place))
        if place in found:
            found[place].count += 1
        elif len(place) <= DEEPEST:
            found[place] = Call(name, file, len(place) - 1, kernels_of(frame))

    sys.setprofile(profile)
    try:
        work()
    finally:
        sys.setprofile(None)
    ordered: list[Call] = []

    def add(place: tuple[str, ...]) -> None:
        ordered.append(found[place])
        for other in found:
            if other[:-1] == place:
                add(other)

    for place in list(found):
        if len(place) == 1:
            add(place)
    return ordered


def is_property(frame: FrameType) -> bool:
    """Return whether a frame runs a property."""
    owner = frame.f_locals.get("self")
    return isinstance(getattr(type(owner), frame.f_code.co_name, None), property)


def kernels_of(frame: FrameType) -> tuple[str, ...]:
    """Return the compiled modules that a function names, also as attributes of its object."""
    attributes = getattr(frame.f_locals.get("self"), "__dict__", {})
    names = frame.f_code.co_names
    used = [frame.f_globals.get(name) for name in names]
    used += [type(attributes[name]) for name in names if name in attributes]
    modules = (
        getattr(value, "__module__", None) or getattr(value, "__name__", "") for value in used
    )
    return tuple(dict.fromkeys(m.rpartition(".")[2] for m in modules if m.endswith("_kernel")))


def draw_walk(calls: list[Call]) -> str:
    """Return the calls as an SVG picture: indented by depth, coloured by room."""
    parts = []
    for row, call in enumerate(calls):
        x, y = 10 + INDENT_PX * call.depth, 10 + ROW_PX * row
        times = f" × {call.count}" if call.count > 1 else ""
        kernels = f"   kernel: {', '.join(call.kernels)}" if call.kernels else ""
        colour = COLOURS.get(call.room, "#e4e4e4")
        weight = "bold" if call.depth == 0 else "normal"
        parts.append(
            f'<rect x="{x}" y="{y}" width="270" height="{ROW_PX - 4}" rx="4" fill="{colour}"/>'
            f'<text x="{x + 8}" y="{y + 13}" font-weight="{weight}">'
            f"{escape(call.name + times)}</text>"
            f'<text x="{x + 282}" y="{y + 13}" fill="#555">{escape(call.file + kernels)}</text>'
        )
    return _svg(940, 20 + ROW_PX * len(calls), parts)


def room_imports() -> dict[str, Counter[str]]:
    """Return for each room how many of its files import from each other room."""
    found: dict[str, Counter[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        room = _room(path.relative_to(PACKAGE).with_suffix("").parts[0])
        imported = {_room(name.split(".")[1]) for name in _imports(path)}
        found.setdefault(room, Counter()).update(imported - {room, ""})
    found.pop("", None)
    return found


def draw_rooms(imports: dict[str, Counter[str]]) -> str:
    """Return the imports as an SVG table: a room a row and a column, each below what it imports."""
    order: list[str] = []
    left = dict(imports)
    while left:  # the rooms that import the fewest of the others come first
        room = min(left, key=lambda name: (sum(o in left for o in left[name]), name))
        order.append(room)
        del left[room]
    size, head = 46, 110
    parts = []
    for i, room in enumerate(order):
        y = head + ROW_PX * i
        parts.append(f'<text x="8" y="{y + 15}">{room}</text>')
        x = head + size * i
        parts.append(
            f'<text transform="translate({x + size / 2 + 4},{head - 8}) rotate(-60)">{room}</text>'
            f'<rect x="{x}" y="{y}" width="{size - 2}" height="{ROW_PX - 2}" fill="#bbb"/>'
        )
        for j, other in enumerate(order):
            count = imports[room][other]
            if count:
                x = head + size * j
                parts.append(
                    f'<rect x="{x}" y="{y}" width="{size - 2}" height="{ROW_PX - 2}" '
                    f'fill="#cfe3f5"/>'
                    f'<text x="{x + size / 2 - 1}" y="{y + 15}" text-anchor="middle">{count}</text>'
                )
    return _svg(head + size * len(order) + 70, head + ROW_PX * len(order) + 10, parts)


def _room(name: str) -> str:
    """Return the room of a module of the package; "" for those that stand beside the rooms."""
    return name if (PACKAGE / name).is_dir() and not name.startswith("_") else ""


def _imports(path: Path) -> list[str]:
    """Return the modules of the package that a file imports when it runs."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    typing_only = {
        id(node)
        for block in ast.walk(tree)
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
        for node in ast.walk(block)
    }
    names = []
    for node in ast.walk(tree):
        if id(node) in typing_only:
            continue
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.append(node.module)
        elif isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
    return [name for name in names if name.startswith("fpmatch.")]


def _svg(width: float, height: float, parts: list[str]) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}" style="{_STYLE}">'
        f'<rect width="100%" height="100%" fill="white"/>{"".join(parts)}</svg>\n'
    )
