"""Plots by matplotlib that come out the same everywhere and every time."""

from __future__ import annotations

import io
import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from matplotlib.figure import Figure


@contextmanager
def plain_style() -> Iterator[None]:
    """Draw the same picture whatever the user's matplotlibrc says, with text as text in an SVG."""
    import matplotlib.style  # noqa: PLC0415

    settings = {"svg.fonttype": "none", "svg.hashsalt": "fpmatch", "text.parse_math": False}
    with matplotlib.style.context(["default", settings]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name may be in any script
        yield


def figure_bytes(figure: Figure, path: str | os.PathLike[str], dpi: int) -> bytes:
    """Return what a file of a figure holds; the same figure gives the same SVG.

    Parameters
    ----------
    figure : Figure
        The figure, made and to be encoded inside `plain_style`.
    path : path-like
        The file that it is for, which tells the format by its ending.
    dpi : int
        Pixels an inch, where the format has pixels.

    Returns
    -------
    bytes
        The file's content.
    """
    content = io.BytesIO()
    suffix = Path(path).suffix.lower().removeprefix(".")
    figure.savefig(
        content, format=suffix, dpi=dpi, metadata={"Date": None} if suffix == "svg" else None
    )
    return content.getvalue()
