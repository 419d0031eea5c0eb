"""The command ``figures``: the pictures of the documentation."""

from __future__ import annotations

import io
from functools import partial
from typing import TYPE_CHECKING, Final

import click
from PIL import Image

import fpmatch
from fpmatch.base.folders import write_files
from fpmatch.lab.explain.paper import PaperMethod, explain_points
from fpmatch.pointset.paper.matcher import DEFAULT_RHO, UnitCircleParameters
from research.commands import PATH, ROOT, Command
from research.figures.how_it_works import how_it_works
from research.figures.synthesis import synthesis_figures
from research.points.random_sets import random_pair

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

OVERLAY_PAIR: Final = ("101_1", "101_3")
STEPS_PAIR: Final = ("102_1", "102_4")
COLOURS: Final = 160  # of a picture's palette
EASY_SEED: Final = 165  # makes random sets with a ring of six points that is easy to read
POINTS: Final = 40
ETA, LAMBDA = 0.175, 0.428  # jitter and precision of the first rows of the paper's tables


@click.command(cls=Command)
@click.option(
    "--out", type=PATH, default=ROOT / "docs" / "figures", help="Folder.  [default: docs/figures]"
)
@click.option(
    "--only", type=click.Choice(["prints", "points", "synthesis"]), help="Draw no others."
)
def command(out: Path, only: str | None) -> None:
    """Draw the figures of the documentation.

    overlay.png is what ``fpmatch verify sample_data/101_1.tif sample_data/101_3.tif --overlay``
    writes, ridges.png the same with ``--view ridges``, with a palette of fewer colours.
    how_it_works.png shows two prints at each step of the matcher "unit-circle". points/ holds the
    pictures that ``fpmatch explain`` draws of two random point sets: Q is P rotated, scaled,
    shifted and jittered. synthesis/ holds synthetic prints of all sensors, and of all presets.
    """
    out.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    if only in {None, "prints"}:
        written += _draw_prints(out)
    if only in {None, "points"}:
        written += write_files(_point_figures(), out / "points", public=True)
    if only in {None, "synthesis"}:
        written += write_files(synthesis_figures(), out / "synthesis", public=True)
    for path in written:
        click.echo(f"{path}: {path.stat().st_size // 1000} kB")


def _draw_prints(folder: Path) -> list[Path]:
    written = []
    for name, drawing, pair in (
        ("overlay.png", _overlay, OVERLAY_PAIR),
        ("ridges.png", partial(_overlay, ridges=True), OVERLAY_PAIR),
        ("how_it_works.png", how_it_works, STEPS_PAIR),
    ):
        prints = [ROOT / "sample_data" / f"{impression}.tif" for impression in pair]
        written.append(folder / name)
        written[-1].write_bytes(small_png(drawing(*prints)))
    return written


def _point_figures() -> dict[str, bytes]:
    """Draw the paper's steps on two random sets."""
    made = random_pair(POINTS, POINTS, 1.0, ETA, LAMBDA, rng=EASY_SEED)
    sets = ("random", made.p), ("random, moved", made.q)
    steps = explain_points(PaperMethod.of_sets(sets, UnitCircleParameters(), DEFAULT_RHO))
    return {f"{step.name}.svg": step.picture for step in steps if step.picture is not None}


def _overlay(probe_path: Path, reference_path: Path, **view: bool) -> NDArray[np.uint8]:
    """Draw one print over another as the commands do."""
    probe, reference = fpmatch.read_image(probe_path), fpmatch.read_image(reference_path)
    found = fpmatch.verify(fpmatch.extract(probe), fpmatch.extract(reference))
    return fpmatch.draw(probe, reference, found, **view)


def small_png(picture: NDArray[np.uint8]) -> bytes:
    """Encode a picture with a palette, which halves its size or better."""
    file = io.BytesIO()
    few = Image.fromarray(picture).quantize(
        COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
    )
    few.save(file, "png", optimize=True)
    return file.getvalue()
