"""Plots of matplotlib as SVG inside a page, in the page's colours, light or dark."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import OutputError
from fpmatch.lab.plots.style import plain_style

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from matplotlib.figure import Figure

# Placeholders that matplotlib writes, each replaced by a CSS variable of the page.
_NAMES: Final = {
    f"#00000{k}": name
    for k, name in enumerate(("ink", "muted", "grid", "shade", "genuine", "impostor"), start=1)
}
INK, MUTED, GRID, SHADE, GENUINE, IMPOSTOR = _NAMES
SERIES_COLOURS: Final = 8
_FIRST_SERIES: Final = 0x10
_COLOUR: Final = re.compile(r"#0000([0-9a-f]{2})")
_IDENTIFIER: Final = re.compile(r'(\bid="|url\(#|href="#)')
_SETTINGS: Final = {
    "text.parse_math": True,
    "font.family": "sans-serif",
    "font.size": 11.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "text.color": INK,
    "grid.color": GRID,
    "axes.grid": True,
    "lines.linewidth": 1.6,
    "path.simplify_threshold": 0.3,
}


def series_colour(index: int) -> str:
    """Return the placeholder of the colour of a page's `index`-th series."""
    return f"#0000{_FIRST_SERIES + index % SERIES_COLOURS:02x}"


def series_dashes(index: int) -> str:
    """Return the dashes of a page's `index`-th series, by which lines differ without colour."""
    return ("-", "--", "-.", ":")[index // 2 % 4]


def series_look(index: int) -> dict[str, Any]:
    """Return colour and dashes of a line, as matplotlib takes them."""
    return {"color": series_colour(index), "linestyle": series_dashes(index)}


def settings() -> AbstractContextManager[None]:
    """Draw with matplotlib's defaults and `_SETTINGS`, independent of the user's."""
    return plain_style(_SETTINGS)


def inline_svg(figure: Figure, name: str, label: str) -> str:
    """Return a figure as an SVG element that takes the width and the colours of its page.

    `name` begins all identifiers, different for each plot of a page; `label` is for screen readers.
    """
    import matplotlib as mpl  # noqa: PLC0415

    stream, metadata = io.StringIO(), {"Date": None, "Creator": None}
    with mpl.rc_context({"svg.hashsalt": name}):
        figure.savefig(stream, format="svg", transparent=True, metadata=metadata)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = _COLOUR.sub(lambda match: f"var(--{colour_name(match[0])})", text)
    text = _IDENTIFIER.sub(lambda match: f"{match[1]}{name}-", text)
    box = re.match(r'<svg[^>]*viewBox="([^"]*)"[^>]*>', text)
    if box is None:
        raise OutputError("matplotlib wrote no SVG")
    opened = (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'viewBox="{box[1]}" role="img" aria-label="{label}">'
    )
    return opened + text[box.end() :].strip()


def colour_name(placeholder: str) -> str:
    """Return the CSS variable of a placeholder colour."""
    return _NAMES.get(placeholder) or f"series-{int(placeholder[5:], 16) - _FIRST_SERIES}"
