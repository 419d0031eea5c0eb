"""Figures by matplotlib that look the same everywhere and every time, and the words in plots."""

from __future__ import annotations

import io
import warnings
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from fpmatch.base.output import check_writable
from fpmatch.errors import OutputError

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping

    from matplotlib.figure import Figure

    from fpmatch.pointset.geometry.point_match import PointMatch
    from fpmatch.pointset.geometry.similarity import Similarity


PLOT_FORMATS: Final = (".png", ".svg", ".pdf")
PLOT_DPI: Final = 150
_NAME_LETTERS: Final = 30
# Distinct with any kind of colour vision: Okabe and Ito, "Color Universal Design" (2008).
SERIES_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")


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


def match_facts(match: PointMatch) -> list[tuple[str, str]]:
    """Return a match, if it is one, as (label, value): pairs, transform, residual, chance."""
    t = match.transform
    if t is None:
        return []
    facts = [
        ("Pairs", f"{len(match.pairs):,}, {match.matched_share:.1%} of the smaller set"),
        ("Transform", _transform_in_words(t)),
        ("Residual", f"{match.rms:.4g} rms"),
    ]
    if match.chance is not None:
        count = f"{match.chance:.2g}" if match.chance > 0 else "less than 1e-300"
        facts.append(("Chance", f"{count} matches as good expected between independent sets"))
    return facts


def _transform_in_words(t: Similarity) -> str:
    """Describe a transform, in the order in which its parts are applied."""
    turn = round(t.rotation_deg, 3)  # the sense holds wherever y points
    sense = "" if turn == 0 else " from x to y" if turn > 0 else " from y to x"
    x, y = (round(value, 12) + 0.0 for value in (t.tx, t.ty))  # errors of rounding are 0
    mirror = "mirrored (y to -y), " if t.mirrored else ""
    movement = f"rotation {abs(turn):.3f}°{sense}, shift {x:+.6g}, {y:+.6g}"
    return f"{mirror}scale {t.scale:.6g}, {movement}"
