"""The page that the pictures of point sets are drawn on: title, framed panels, caption.

Matplotlib draws it, with settings of its own and never those of the user, so that the same points
make the same file. All lengths are pixels of a page that is 800 wide.
"""

from __future__ import annotations

import io
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, Literal, cast, get_args

import numpy as np

from fpmatch.drawing.palette import PANEL_EDGE, PAPER, TEXT, TEXT_MUTED, Colour, hexadecimal
from fpmatch.drawing.paper_figures.svg import with_rims
from fpmatch.drawing.paper_figures.text import FONT, POINTS_PER_PX, PX_PER_INCH, wrapped
from fpmatch.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes
    from matplotlib.text import Annotation
    from numpy.typing import ArrayLike

FileFormat = Literal["svg", "png"]
FILE_FORMATS: Final[tuple[FileFormat, ...]] = get_args(FileFormat)

WIDTH: Final = 800
MARGIN: Final = 20
GAP: Final = 20
TITLE_HEIGHT, TITLE_BASELINE, TITLE_SIZE = 44, 32, 19.0
PANEL_TITLE_HEIGHT, PANEL_TITLE_SIZE = 26, 14.0
BELOW_TITLE, BELOW_PANEL = 9, 8
CAPTION_SIZE, LEADING, ABOVE_CAPTION = 14.0, 20, 16
RIM: Final = 3.0  # width of the white around a label
PNG_PIXELS: Final = 2  # of a PNG, for each pixel of the page

_SETTINGS: Final[dict[str, Any]] = {
    "svg.hashsalt": "fpmatch",
    "svg.fonttype": "none",  # text stays text: small, and found by a search
    "font.family": "sans-serif",
    "font.sans-serif": [FONT, "Verdana"],
    "axes.unicode_minus": True,
    "path.simplify": False,
}
_RIM: Final = (
    f"fill: {hexadecimal(PAPER)}; stroke: {hexadecimal(PAPER)}; "
    f"stroke-width: {RIM * POINTS_PER_PX}; stroke-linejoin: round"
)


@contextmanager
def settings() -> Iterator[None]:
    """Draw with matplotlib's own settings and ours, whatever the user's are.

    Raises
    ------
    OutputError
        If matplotlib is not installed.
    """
    try:
        import matplotlib as mpl  # noqa: PLC0415
    except ImportError as error:
        raise OutputError(
            'pictures of point sets need matplotlib: pip install "fpmatch[plot]"'
        ) from error
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(cast("Any", _SETTINGS))
        yield


class Sheet:
    """Compose one page; to be used inside `settings`.

    Parameters
    ----------
    title : str
        The line above the panels.
    caption : str
        What is to be seen, and its numbers; broken into lines below the panels.
    columns : int
        Panels in a row.
    heights : sequence of int
        Height of the panels of each row.
    """

    def __init__(self, title: str, caption: str, columns: int, heights: Sequence[int]) -> None:
        from matplotlib.figure import Figure  # noqa: PLC0415

        self.title, self.caption = title, caption
        self._columns, self._heights = columns, heights
        lines = wrapped(caption, CAPTION_SIZE, WIDTH - 2 * MARGIN)
        body = TITLE_HEIGHT + sum(height + PANEL_TITLE_HEIGHT for height in heights)
        self._page_height = body + ABOVE_CAPTION + len(lines) * LEADING
        self.figure = Figure(
            figsize=(WIDTH / PX_PER_INCH, self._page_height / PX_PER_INCH),
            dpi=PX_PER_INCH,
            facecolor=hexadecimal(PAPER),
        )
        self._write(MARGIN, TITLE_BASELINE, title, TITLE_SIZE, TEXT, weight="bold")
        for n, line in enumerate(lines):
            y = body + ABOVE_CAPTION + n * LEADING
            self._write(MARGIN, y, line, CAPTION_SIZE, TEXT_MUTED)

    def panel(
        self, row: int, column: int, title: str, *, columns: int = 1, framed: bool = True
    ) -> Axes:
        """Open the panel at `row` and `column`, `columns` wide, under a title of its own."""
        single = (WIDTH - 2 * MARGIN - (self._columns - 1) * GAP) / self._columns
        left = MARGIN + column * (single + GAP)
        width = columns * single + (columns - 1) * GAP
        above = sum(height + PANEL_TITLE_HEIGHT for height in self._heights[:row])
        top = TITLE_HEIGHT + above + PANEL_TITLE_HEIGHT
        height = self._heights[row] - BELOW_PANEL
        self._write(left, top - BELOW_TITLE, title, PANEL_TITLE_SIZE, TEXT)
        bottom = self._page_height - top - height
        axes = self.figure.add_axes(
            (
                left / WIDTH,
                bottom / self._page_height,
                width / WIDTH,
                height / self._page_height,
            )
        )
        axes.set_xticks([])
        axes.set_yticks([])
        axes.set_xlim(0, width)
        axes.set_ylim(height, 0)
        for spine in axes.spines.values():
            spine.set_visible(framed)
            spine.set_edgecolor(hexadecimal(PANEL_EDGE))
        return axes

    def encoded(self, file_format: FileFormat) -> bytes:
        """Return the page as the content of a file; the same page gives the same bytes."""
        if file_format == "svg":
            return self._as_svg()
        return self._as_png()

    def _as_svg(self) -> bytes:
        about = {**self._about(), "Creator": "fpmatch", "Date": None}
        labels = {f"label{n}": text for n, text in enumerate(self._labels())}
        for name, text in labels.items():
            text.set_gid(name)
            text.set_path_effects([])
        file = io.BytesIO()
        self.figure.savefig(file, format="svg", metadata=about)
        return with_rims(file.getvalue(), set(labels), _RIM)

    def _as_png(self) -> bytes:
        from matplotlib.patheffects import withStroke  # noqa: PLC0415

        rim = withStroke(linewidth=RIM * POINTS_PER_PX, foreground=hexadecimal(PAPER))
        for text in self._labels():
            text.set_path_effects([rim])
        file = io.BytesIO()
        about = {**self._about(), "Software": "fpmatch"}
        self.figure.savefig(file, format="png", dpi=PNG_PIXELS * PX_PER_INCH, metadata=about)
        return file.getvalue()

    def _about(self) -> dict[str, Any]:
        return {"Title": self.title, "Description": self.caption}

    def _labels(self) -> list[Annotation]:
        """Return what `label` wrote: the texts that have a rim."""
        from matplotlib.text import Annotation  # noqa: PLC0415

        return [text for text in self.figure.findobj(Annotation) if isinstance(text, Annotation)]

    def _write(
        self, x: float, y: float, text: str, size: float, colour: Colour, weight: str = "normal"
    ) -> None:
        self.figure.text(
            x / WIDTH,
            1 - y / self._page_height,
            text,
            fontsize=size * POINTS_PER_PX,
            color=hexadecimal(colour),
            fontweight=weight,
            va="baseline",
            parse_math=False,
        )


def show(axes: Axes, points: ArrayLike, margin: float) -> float:
    """Fit `points` (N, 2), y up, into a panel with `margin` pixels around them.

    Parameters
    ----------
    axes : Axes
        The panel, as `Sheet.panel` opened it.
    points : array_like of float, shape (N, 2)
        What must be seen.
    margin : float
        Pixels to be left free on each side.

    Returns
    -------
    float
        Length of a pixel in the units of the points.
    """
    (left, width), (height, top) = axes.get_xlim(), axes.get_ylim()
    size = np.array([width - left, height - top])
    xy = np.asarray(points, dtype=np.float64)
    low, high = xy.min(axis=0), xy.max(axis=0)
    pixel = float(((high - low) / (size - 2 * margin)).max()) or 1.0
    middle = (low + high) / 2
    (x0, y0), (x1, y1) = middle - size / 2 * pixel, middle + size / 2 * pixel
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    return pixel
