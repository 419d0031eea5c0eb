"""The page of a figure: title, panels, caption. Lengths are pixels of a page that is 800 wide."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from fpmatch.base.output import write_files
from fpmatch.drawing.scene.fonts import wrapped
from fpmatch.drawing.scene.palette import PANEL_EDGE, PAPER, TEXT, TEXT_MUTED, hexadecimal
from fpmatch.errors import OutputError
from fpmatch.lab.plots.style import check_matplotlib, figure_bytes, plain_style

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

FileFormat = Literal["svg", "png"]
FILE_FORMATS: Final[tuple[FileFormat, ...]] = get_args(FileFormat)

PX_PER_INCH: Final = 96
PX: Final = 72 / PX_PER_INCH
"""A pixel of the page in points, which matplotlib measures fonts and lines in."""

WIDTH, MARGIN, GAP = 800, 20, 20
TITLE_SIZE, PANEL_TITLE_SIZE, CAPTION_SIZE = 19.0, 14.0, 14.0
TITLE_BASELINE, PANELS_TOP, PANEL_TITLE_PAD = 32, 70, 9
ABOVE_PANEL, BELOW_PANEL = 26, 8
ABOVE_CAPTION, LEADING = 16, 20
FULL_LINE: Final = 0.98  # of a line's width: fonts are not alike to the pixel everywhere
RIM: Final = 3.0  # width of the white around a label
PNG_PIXELS: Final = 2  # of a PNG, for each pixel of the page

FONT: Final = "DejaVu Sans"  # the one that comes inside matplotlib
STYLE: Final = {
    "axes.edgecolor": hexadecimal(PANEL_EDGE),
    "axes.titlepad": PANEL_TITLE_PAD * PX,
    "axes.titlesize": PANEL_TITLE_SIZE * PX,
    "font.family": "sans-serif",
    "font.sans-serif": [FONT, "Verdana"],
    "lines.dashed_pattern": [4, 3],
    "lines.solid_capstyle": "round",
    "path.simplify": False,
    "text.color": hexadecimal(TEXT),
    "text.parse_math": True,
}
_RIM_CSS: Final = (
    f'g[id^="label"] text{{paint-order:stroke;stroke:{hexadecimal(PAPER)};'
    f"stroke-width:{RIM * PX}px;stroke-linejoin:round}}"
)


@dataclass(frozen=True, slots=True)
class PointFigure:
    """The file of a figure, such as ``figure_5_weights.svg``, and the words in it."""

    file_name: str
    title: str
    caption: str
    content: bytes


def draw_sheets(
    sheets: Mapping[str, Callable[[], Sheet | None]], file_format: FileFormat
) -> list[PointFigure]:
    """Draw sheets as files of the names given; None leaves one out.

    An `OutputError` is raised if matplotlib is not installed, or the format is unknown.
    """
    if file_format not in FILE_FORMATS:
        raise OutputError(f"unknown format {file_format!r}: expected {' or '.join(FILE_FORMATS)}")
    check_matplotlib("a figure of point sets")
    with plain_style(STYLE):
        drawn = [(name, make()) for name, make in sheets.items()]
        return [
            PointFigure(f"{name}.{file_format}", s.title, s.caption, s.encoded(file_format))
            for name, s in drawn
            if s is not None
        ]


def write_point_figures(figures: list[PointFigure], folder: str | os.PathLike[str]) -> list[Path]:
    """Write figures into a folder as `fpmatch.drawing.scene.raster.write_files` does."""
    contents = {figure.file_name: figure.content for figure in figures}
    return write_files(contents, folder, public=True)


class Sheet:
    """Compose one page, inside `plain_style`.

    `mosaic` has a key for each panel, in rows: a panel spans all places of its key, "." stays
    empty. `heights` are those of the rows.
    """

    def __init__(
        self, title: str, caption: str, mosaic: Sequence[Sequence[str]], heights: Sequence[int]
    ) -> None:
        from matplotlib.figure import Figure  # noqa: PLC0415

        self.title, self.caption = title, caption
        lines = wrapped(caption, CAPTION_SIZE, FULL_LINE * (WIDTH - 2 * MARGIN), label_width)
        gap = ABOVE_PANEL + BELOW_PANEL
        bottom = PANELS_TOP + sum(heights) + gap * (len(heights) - 1)
        first = bottom + BELOW_PANEL + ABOVE_CAPTION
        height = first + len(lines) * LEADING
        inches = (WIDTH / PX_PER_INCH, height / PX_PER_INCH)
        self.figure = Figure(figsize=inches, dpi=PX_PER_INCH, facecolor=hexadecimal(PAPER))

        def write(y: float, text: str, size: float, **style: Any) -> None:
            x, y = MARGIN / WIDTH, 1 - y / height
            self.figure.text(x, y, text, fontsize=size * PX, parse_math=False, **style)

        write(TITLE_BASELINE, title, TITLE_SIZE, fontweight="bold")
        for n, line in enumerate(lines):
            write(first + n * LEADING, line, CAPTION_SIZE, color=hexadecimal(TEXT_MUTED))
        columns = len(mosaic[0])
        width = (WIDTH - 2 * MARGIN - (columns - 1) * GAP) / columns
        sides = {"left": MARGIN / WIDTH, "right": 1 - MARGIN / WIDTH}
        ends = {"top": 1 - PANELS_TOP / height, "bottom": 1 - bottom / height}
        gaps = {"wspace": GAP / width, "hspace": gap * len(heights) / sum(heights)}
        self._panels: Any = self.figure.subplot_mosaic(
            [list(row) for row in mosaic], height_ratios=heights, gridspec_kw=sides | ends | gaps
        )
        for axes in self._panels.values():
            axes.set(xticks=[], yticks=[])

    def panel(self, key: str, title: str) -> Axes:
        """Return the panel of a key, and write its title above it."""
        axes: Axes = self._panels[key]
        axes.set_title(title, loc="left", parse_math=False)
        return axes

    def encoded(self, file_format: FileFormat) -> bytes:
        """Return the page as the content of a file, its labels with white rims."""
        from matplotlib.patheffects import withStroke  # noqa: PLC0415
        from matplotlib.text import Annotation  # noqa: PLC0415

        vectors = file_format == "svg"
        rim = withStroke(linewidth=RIM * PX, foreground=hexadecimal(PAPER))
        for n, text in enumerate(self.figure.findobj(Annotation)):
            text.set_gid(f"label{n}")
            text.set_path_effects([] if vectors else [rim])
        creator = "Creator" if vectors else "Software"
        about = {"Title": self.title, "Description": self.caption, creator: "fpmatch"}
        dpi = PNG_PIXELS * PX_PER_INCH
        content = figure_bytes(self.figure, f"figure.{file_format}", dpi, about)
        return _with_rims(content) if vectors else content


def _with_rims(svg: bytes) -> bytes:
    """Add the rims, which in an SVG would turn texts into outlines; the size is in pixels."""
    text = svg.decode().replace("<style", f'<style type="text/css">{_RIM_CSS}</style>\n  <style', 1)
    text = text.replace("<svg ", '<svg role="img" ', 1)
    in_px = re.sub(r'"([\d.]+)pt"', lambda size: f'"{float(size[1]) / PX:g}"', text, count=2)
    return in_px.encode()


def label_width(text: str, size: float) -> float:
    """Return the width of `text` in pixels at `size`, in the font of the figures."""
    from matplotlib.font_manager import FontProperties  # noqa: PLC0415
    from matplotlib.textpath import text_to_path  # noqa: PLC0415

    font = FontProperties(family=FONT, size=size)
    return float(text_to_path.get_text_width_height_descent(text, font, "$" in text)[0])


def show(axes: Axes, points: ArrayLike, margin: float = 0.0, *, y_down: bool = False) -> float:
    """Fit `points` (N, 2) into a panel with `margin` pixels around them.

    Returns the length of a pixel in the units of the points.
    """
    size = np.asarray(axes.bbox.size)
    xy = np.asarray(points, dtype=np.float64)
    low, high = xy.min(axis=0), xy.max(axis=0)
    pixel = float(((high - low) / (size - 2 * margin)).max()) or 1.0
    (x0, y0), (x1, y1) = ((low + high) / 2 + side * size / 2 * pixel for side in (-1, 1))
    axes.set(xlim=(x0, x1), ylim=(y1, y0) if y_down else (y0, y1))
    return pixel
