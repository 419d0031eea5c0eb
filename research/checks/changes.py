"""The command ``check changes``: what the tutorial's changes do to the hard sample prints."""

from __future__ import annotations

import json
import tempfile
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from unittest.mock import patch

import click
import numpy as np
from click.testing import CliRunner

from fpmatch.cli.group import fpmatch
from fpmatch.errors import FpmatchError
from fpmatch.matching.reference import pair_mesh
from fpmatch.pointset.paper.parametrize import ring_weights
from research.commands import PATH, ROOT, Command
from research.markdown import markdown_table, write_marked_block

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from numpy.typing import NDArray

PRINTS: Final = ROOT / "sample_data" / "hard"
RATES: Final = {"eer": "EER", "fmr100": "FMR100"}
PARAMETERS: Final = ("reach_px=1,reach_per_px=0", "place_tolerance=10")
STEP: Final = "equal weights in `mesh_of_pairs`"


def equal_weights(away: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return the same weight for all corners of each ring, in place of eq. (4)."""
    weights = np.sign(ring_weights(away))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


@click.command(cls=Command)
@click.option("--into", metavar="PAGE.md", type=PATH, help="Write the table into this page.")
def command(into: Path | None) -> None:
    """Measure the changes of the tutorial on the hard sample prints, each against none."""
    table = [["change", "rate", "before", "after", "points", "95 % interval", "", "p"]]
    for parameter in PARAMETERS:
        changed = f"unit-circle:{parameter}"
        table += _rows(f"`{parameter}`", "unit-circle", changed, nullcontext())
    step = patch.object(pair_mesh, "ring_weights", equal_weights)
    table += _rows(STEP, "reference", "reference", step)
    click.echo(markdown_table(table))
    if into:
        write_marked_block(into, "changes", markdown_table(table))


def _rows(name: str, matcher: str, changed: str, step: AbstractContextManager[Any]) -> list[Any]:
    """Return the rates with a change beside those without, and of the last McNemar's p-value."""
    with tempfile.TemporaryDirectory() as folder:
        scores = Path(folder, "before.csv")
        _evaluated("--matcher", matcher, "--scores", scores)
        with step:
            document = _evaluated("--matcher", changed, "--baseline", scores)
    compared = document["baseline"]
    p = f"{compared['decisions']['mcnemar_p']:.2g}"
    rows = []
    for rate, title in RATES.items():
        one = compared["pooled"][rate]
        before, after = 100 * one["before"], 100 * one["now"]
        limits = one["change_interval"] or ()
        numbers = f"{before:.1f} %", f"{after:.1f} %", f"{after - before:+.1f}"
        last = p if rate == "fmr100" else ""
        rows.append(
            [
                name,
                title,
                *numbers,
                " to ".join(f"{100 * limit:+.1f}" for limit in limits),
                one["verdict"],
                last,
            ]
        )
    return rows


def _evaluated(*options: object) -> dict[str, Any]:
    """Run ``fpmatch evaluate --json`` in this process."""
    words = ("evaluate", PRINTS, "--json", "--workers", 1, *options)
    done = CliRunner().invoke(fpmatch, list(map(str, words)))
    if done.exit_code:
        raise FpmatchError(done.stderr)
    document: dict[str, Any] = json.loads(done.stdout)
    return document
