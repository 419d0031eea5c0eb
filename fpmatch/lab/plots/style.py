"""Figures by matplotlib that look the same everywhere, and the plot of two matched point sets.

The plot shows P, moved onto Q; side by side where there is no match; y points up.
"""

from __future__ import annotations

import io
import math
import warnings
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.palette import hexadecimal
from fpmatch.errors import OutputError
from fpmatch.prints.report import verdict

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fpmatch.pointset.geometry.point_match import PointMatch

    Floats = NDArray[np.float64]
    Mark = tuple[str, palette.Colour, float, bool]

PLOT_FORMATS: Final = (".png", ".svg", ".pdf")
PLOT_DPI: Final = 150
_NAME_LETTERS: Final = 30
# Distinct with any kind of colour vision: Okabe and Ito, "Color Universal Design" (2008).
SERIES_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
# Marks of points: form, colour, size as a share of a point's room, and whether they are filled.
_Q_PAIRED: Final = ("o", palette.REFERENCE_MARK, 1.5, False)
_Q_ALONE: Final = ("s", palette.REFERENCE_INK, 0.7, False)
_P_PAIRED: Final = ("o", palette.PROBE_MARK, 0.6, True)
_P_ALONE: Final = ("x", palette.PROBE_INK, 0.7, False)


def check_matplotlib(purpose: str) -> None:
    """Raise an `OutputError` that begins with `purpose` where matplotlib is not installed."""
    if find_spec("matplotlib") is None:
        raise OutputError(f"{purpose} needs matplotlib: pip install 'fpmatch[plot]'")


def check_plot(path: str | os.PathLike[str]) -> None:
    """Refuse a plot that cannot be written, before hours of work, with an `OutputError`."""
    if Path(path).suffix.lower() not in PLOT_FORMATS:
        raise OutputError(f"{path}: a plot's name ends with {', '.join(PLOT_FORMATS)}")
    check_writable(path)
    check_matplotlib(f"{path}:")


@contextmanager
def plain_style(settings: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Draw with matplotlib's defaults and `settings`, and none of the user's; text stays text."""
    import matplotlib.style  # noqa: PLC0415

    ours = {"svg.fonttype": "none", "svg.hashsalt": "fpmatch", "text.parse_math": False}
    styles = cast("Any", ["default", ours | dict(settings or {})])
    with matplotlib.style.context(styles), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name may be in any script
        yield


def save_figure(path: str | os.PathLike[str], figure: Figure) -> None:
    """Write a figure into a file, inside `plain_style`."""
    atomic_write_bytes(path, figure_bytes(figure, path, PLOT_DPI), public=True)


def figure_bytes(figure: Figure, path: str | os.PathLike[str], dpi: int) -> bytes:
    """Return the content of a figure's file, whose ending is the format, inside `plain_style`.

    The same figure gives the same SVG. `dpi` is used for formats that have pixels.
    """
    content = io.BytesIO()
    suffix = Path(path).suffix.lower().removeprefix(".")
    about = {"Date": None} if suffix == "svg" else {}
    figure.savefig(content, format=suffix, dpi=dpi, metadata=cast("Any", about))
    return content.getvalue()


def number(value: float, digits: int = 3) -> str:
    """Write a number with a proper minus and no minus zero."""
    return f"{round(float(value), digits) + 0.0:.{digits}f}".replace("-", "−")


def short_name(name: str) -> str:
    """Return a name as a title shows it; of a long path the end, which distinguishes it."""
    clean = "".join(sign if sign.isprintable() else " " for sign in name)
    return clean if len(clean) <= _NAME_LETTERS else "…" + clean[1 - _NAME_LETTERS :]


def save_point_plot(
    path: str | os.PathLike[str],
    p: Floats,
    q: Floats,
    match: PointMatch,
    *,
    names: tuple[str, str] = ("P", "Q"),
) -> None:
    """Draw Q (M, 2), and P (N, 2) moved onto it, with pairs linked; apart where there is no match.

    `match` is the result of `fpmatch.match_points`, `names` are those of the sets. Raises the
    errors of `check_plot`; no file is left behind then.
    """
    check_plot(path)
    with plain_style():
        save_figure(path, _draw(p, q, match, [short_name(name) for name in names]))


def _draw(p: Floats, q: Floats, match: PointMatch, names: list[str]) -> Figure:
    from matplotlib.collections import LineCollection  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    t = match.transform
    figure = Figure((9.0, 5.0 if t is None else 8.0), layout="constrained")  # inches
    colour = hexadecimal(palette.NO_MATCH if t is None else palette.MATCH)
    figure.suptitle(verdict(t is not None), color=colour, weight="bold", fontsize="x-large")
    if t is None:
        marks = zip(figure.subplots(1, 2), (p, q), (_P_PAIRED, _Q_PAIRED), "PQ", names, strict=True)
        for axes, points, mark, letter, name in marks:
            _axes(axes, f"{letter} ({name}): {len(points):,} points", [(points, mark, "")])
        return figure
    i, j = match.pairs.T
    moved, axes = t.apply(p), figure.subplots()
    facts = [f"P ({names[0]}), {'mirrored and ' * t.mirrored}moved, on Q ({names[1]})"]
    facts += [f"{label}: {value}" for label, value in match.facts()]
    kinds = [
        (q[j], _Q_PAIRED, "Q, paired"),
        (np.delete(q, j, axis=0), _Q_ALONE, "Q, unpaired"),
        (moved[i], _P_PAIRED, "P, moved, paired"),
        (np.delete(moved, i, axis=0), _P_ALONE, "P, moved, unpaired"),
    ]
    links, colour = np.stack([moved[i], q[j]], axis=1), hexadecimal(palette.PAIR_LINK)
    axes.add_collection(LineCollection(list(links), colors=colour, zorder=3))
    _axes(axes, "\n".join(facts), kinds)
    figure.legend(loc="outside lower left", ncols=2, frameon=False)
    return figure


def _axes(axes: Axes, title: str, kinds: list[tuple[Floats, Mark, str]]) -> None:
    """Draw kinds of points; the more there are, the smaller."""
    size = float(np.clip(200 / math.sqrt(sum(len(one[0]) for one in kinds) + 1), 0.4, 8.0))
    for points, (marker, colour, share, filled), label in kinds:
        ink = hexadecimal(colour)
        look: dict[str, Any] = {"c": ink, "mfc": ink if filled else "none", "ms": share * size}
        text = label and f"{label} ({len(points):,})"
        axes.plot(*points.T, marker, **look, mew=max(size / 8, 0.45), zorder=4, label=text)
    axes.set_title(title, fontsize="medium", loc="left")
    axes.set(aspect="equal", axisbelow=True, xlabel="x", ylabel="y")
    axes.grid(color="0.92")
