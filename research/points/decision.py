"""``python -m research measure decision``: prints that match by the paper's rule, by its ρ."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.lab.evaluation.run import evaluate_matchers, load_datasets
from fpmatch.matching.matchers.paper import PaperMatcher
from research.commands import Command, folders, json_file, print_and_write
from research.tables import RHOS, format_decision

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray


@click.command(cls=Command)
@folders
@json_file
def command(folders: tuple[Path, ...], json_file: Path | None) -> None:
    """Count the pairs of prints that match by the paper's method, for several values of rho.

    DIR are FVC-style databases, compared as by `fpmatch evaluate --protocol extended`.
    """
    (report,) = evaluate_matchers(load_datasets(folders), [PaperMatcher()], workers=1)
    rows = [
        count_accepted(one.name, one.trials.similarity, one.trials.genuine) for one in report.scores
    ]
    print_and_write(format_decision(rows), rows, json_file)


def count_accepted(
    name: str, similarity: NDArray[np.float64], genuine: NDArray[np.bool_]
) -> dict[str, Any]:
    """Count the pairs of a database that match, genuine and impostor, for each ρ of `RHOS`."""
    return {
        "name": name,
        "genuine": int(genuine.sum()),
        "impostor": int((~genuine).sum()),
        "accepted": [
            [int((similarity[kind] > rho).sum()) for kind in (genuine, ~genuine)] for rho in RHOS
        ],
    }
