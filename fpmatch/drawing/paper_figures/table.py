"""A table of short texts in a panel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.drawing.palette import PANEL_EDGE, TEXT, TEXT_MUTED, hexadecimal
from fpmatch.drawing.paper_figures.text import LABEL_SIZE, POINTS_PER_PX, text_width

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

ROW_HEIGHT: Final = 28.0
CELL_GAP: Final = 8.0
FIRST_COLUMN: Final = 0.6  # of the width of another


def table(
    axes: Axes,
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    last: Sequence[str] = (),
    *,
    first: float = FIRST_COLUMN,
) -> None:
    """Write `rows` under `head` into an empty panel, and a `last` row under a line of its own.

    Parameters
    ----------
    axes : Axes
        The panel, as `Sheet.panel` opened it.
    head : sequence of str
        Names of the columns.
    rows : sequence of sequence of str
        The cells; as many a row as there are columns.
    last : sequence of str
        One row more, such as sums.
    first : float
        Width of the first column in widths of another.
    """
    (_, width), (height, _) = axes.get_xlim(), axes.get_ylim()
    lines = [head, *rows, *([last] if last else [])]
    step = min(ROW_HEIGHT, height / (len(lines) + 0.5))
    column = width / (len(head) - 1 + first)
    widest = max(text_width(cell, 1.0) for cells in lines for cell in cells[1:])
    size = min(LABEL_SIZE, 0.7 * step, (column - CELL_GAP) / widest)
    for place, cells in enumerate(lines):
        for n, cell in enumerate(cells):
            axes.text(
                (n + first) * column - CELL_GAP / 2 if n else 0.0,
                (place + 0.7) * step,
                cell,
                fontsize=size * POINTS_PER_PX,
                color=hexadecimal(TEXT if place else TEXT_MUTED),
                ha="right" if n else "left",
                va="baseline",
            )
    for place in (1, *([len(lines) - 1] if last else [])):
        y = place * step
        axes.plot([0, width], [y, y], color=hexadecimal(PANEL_EDGE), linewidth=1.2 * POINTS_PER_PX)
