"""The command that trains the index of large galleries: the rarity of its terms."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

import fpmatch
from fpmatch.base.output import check_writable
from fpmatch.gallery.index.terms import (
    CURVATURES,
    LENGTHS,
    MODEL_FILE,
    SECTORS,
    IndexModel,
    print_terms,
)
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.commands import PATH, Command, write_json
from research.templates.making import make_templates

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate

PRESETS: Final = ("clean", "easy", "normal", "stretched")  # of synthetic prints
SEED: Final = 931


@click.command(cls=Command)
@click.option("--into", type=PATH, default=MODEL_FILE, help="File to write.")
@click.option("--prints", default=32768, show_default=True, help="Prints whose terms are counted.")
def command(into: Path, prints: int) -> None:
    """Train the index of large galleries: count the terms of synthetic prints.

    The prints are of different fingers. The same package writes the same file.
    """
    into.parent.mkdir(parents=True, exist_ok=True)
    check_writable(into)
    with click.progressbar(gallery_prints(prints), length=prints, label="prints") as counted:
        terms = np.concatenate([print_terms(print_)[0] for print_ in counted])
    provenance = {
        "presets": PRESETS,
        "prints": prints,
        "seed": SEED,
        "version": fpmatch.__version__,
        "command": "python -m research train index",
    }
    write_json(into, {"provenance": provenance, **document_of(model_of_edges(terms, prints))})
    click.echo(into)


def document_of(model: IndexModel) -> dict[str, Any]:
    """Return a model as the document of a file, with rounded numbers."""
    return {name: _rounded(getattr(model, name)) for name in ("lengths", "directions", "edges")}


def _rounded(numbers: NDArray[np.float64] | float) -> Any:
    return np.vectorize(lambda value: float(f"{value:.4g}"), [np.float64])(numbers).tolist()


def model_of_edges(term: NDArray[np.uint16], prints: int) -> IndexModel:
    """Return the model of the edges of so many prints, given by their terms."""
    shape = SECTORS, SECTORS, CURVATURES
    length, directions = np.divmod(term.astype(np.int64), np.prod(shape))
    counted = np.bincount(directions, minlength=np.prod(shape)).reshape(shape)
    # an edge is read from either of its ends, from which its sides change places
    half = SECTORS // 2
    other = np.roll(counted.transpose(1, 0, 2), (half, half), (0, 1))
    other = other[:, :, [*range(CURVATURES - 2, -1, -1), CURVATURES - 1]]
    both = (counted + other) / max(2 * len(term), 1)
    shares = np.bincount(length, minlength=LENGTHS) / max(len(term), 1)
    return IndexModel(shares, both, len(term) / max(prints, 1))


def gallery_prints(count: int) -> Iterator[PreparedTemplate]:
    """Yield prints of different synthetic fingers, of all presets and sensors in turn."""
    families = list(product(PRESETS, sorted(SENSORS)))
    fingers = range(-(-count // len(families)))
    made = [
        make_templates(SEED + k, fingers, 1, preset=preset, sensors=(sensor,))
        for k, (preset, sensor) in enumerate(families)
    ]
    for k in range(count):
        yield MATCHER.prepare(next(made[k % len(made)]))
