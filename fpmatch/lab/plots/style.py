"""Figures by matplotlib that look the same everywhere and every time."""

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

PLOT_FORMATS: Final = (".png", ".svg", ".pdf")
PLOT_DPI: Final = 150
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


def figure_bytes(
    figure: Figure,
    path: str | os.PathLike[str],
    dpi: int,
    metadata: Mapping[str, str | None] | None = None,
) -> bytes:
    """Return the content of a figure's file, whose ending is the format, inside `plain_style`.

    The same figure gives the same SVG. `dpi` is used for formats that have pixels; `metadata` is
    that of the file, such as its title.
    """
    content = io.BytesIO()
    suffix = Path(path).suffix.lower().removeprefix(".")
    about = dict(metadata or {}) | ({"Date": None} if suffix == "svg" else {})
    figure.savefig(content, format=suffix, dpi=dpi, metadata=cast("Any", about))
    return content.getvalue()
