"""What revocable templates cost and hold: error rates, and what attacks on them find."""

from __future__ import annotations

import os
import statistics
from dataclasses import asdict
from functools import partial
from itertools import pairwise
from timeit import timeit
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np
from scipy.spatial import Delaunay

from fpmatch.gallery.encryption.keys import Key
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch_revocable.command import DEFAULT_FMR
from fpmatch_revocable.compare import similarity
from fpmatch_revocable.template import protect
from research.all_pairs import compare_all_pairs
from research.attacks.linkage import PrintSet, linkability, try_all_cells, try_dictionary
from research.commands import Command, folders, json_file, print_and_write, workers
from research.databases import IMPRESSIONS, TEST_SEED, extract_folders, prints_of
from research.tables.revocable import format_revocable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.templates.minutiae import Template

FINGERS: Final = 40  # synthetic ones that are attacked
FINGERS_OF_SET: Final = 10  # as in the FVC sets
STRANGERS: Final = 1000  # synthetic fingers in the dictionary of templates
SPEED_PAIRS: Final = 200
DELAUNAY_POINTS: Final = 40


def measure_revocable(
    sets: Sequence[ExtractedSet], *, fingers: int = FINGERS, strangers: int = STRANGERS
) -> dict[str, Any]:
    """Return error rates by database, what attacks find, sizes and times."""
    keys = Key(os.urandom(32)), Key(os.urandom(32))
    rates: list[dict[str, Any]] = []
    attacked: list[PrintSet] = []
    for one in sets:
        there = prints_of(one)
        _, finger = np.unique([shown.finger for shown, _ in there], return_inverse=True)
        prints = PrintSet([template for _, template in there], finger)
        attacked.append(prints)
        pairs = np.triu_indices(len(there), 1)
        mated = prints.mated[pairs]
        made = [protect(template, keys[0]) for template in prints.templates]
        revocable = np.array([similarity(made[i], made[j]) for i, j in zip(*pairs, strict=True)])
        minutiae = compare_all_pairs(prints.templates)
        rates.append(
            {
                "name": one.dataset.name,
                "revocable": asdict(error_rates(revocable[mated], revocable[~mated])),
                "minutiae": asdict(error_rates(minutiae[mated], minutiae[~mated])),
            }
        )
    real = [template for one in attacked for template in one.templates]
    for first in range(0, fingers, FINGERS_OF_SET):
        numbers = range(first, first + FINGERS_OF_SET)
        synthetic = list(make_templates(TEST_SEED, numbers, IMPRESSIONS))
        attacked.append(PrintSet(synthetic, np.repeat(numbers, IMPRESSIONS)))
    others = list(make_templates(TEST_SEED, range(fingers, fingers + strangers)))
    return {
        "sets": rates,
        "linkability": linkability(attacked, keys),
        "dictionary": {
            "strangers": strangers,
            "fmr": DEFAULT_FMR,
            **try_dictionary(attacked, keys, others),
            "all_cells": try_all_cells(real, keys[0]),
        },
        **_costs(real, keys[0]),
    }


def _costs(templates: Sequence[Template], key: Key) -> dict[str, float]:
    """Return bytes of a template, and times as ratios to scipy's Delaunay of 40 points."""
    points = np.random.default_rng(0).uniform(0, 300, (DELAUNAY_POINTS, 2))
    some = templates[:SPEED_PAIRS]
    made = [protect(template, key) for template in some]
    for one in made:
        one.index  # noqa: B018  (sorted once for all comparisons)
    unit = _median_s([lambda: Delaunay(points)] * SPEED_PAIRS)
    pairs = [partial(similarity, a, b) for a, b in pairwise(made)]
    protected = [partial(protect, template, key) for template in some]
    return {
        "bytes": made[0].words.nbytes,
        "delaunay_us": unit * 1e6,
        "compare_ratio": _median_s(pairs) / unit,
        "protect_ratio": _median_s(protected) / unit,
    }


def _median_s(calls: Sequence[Callable[[], object]]) -> float:
    return statistics.median(timeit(call, number=1) for call in calls)


@click.command(cls=Command)
@folders
@json_file
@workers
def command(folders: tuple[Path, ...], json_file: Path | None, workers: int | None) -> None:
    """Measure revocable templates of the prints of FVC-style databases DIR.

    All impressions of a database are compared, pairs of one finger are genuine: as revocable
    templates of one key, and by the default matcher. Templates of two random keys, also of
    synthetic prints, are judged by each attack, with no key known or with one; D_sys (ISO/IEC
    30136) is 0 where mated and non-mated pairs are judged alike. Templates of a known key are
    compared with dictionaries.

    --json writes what ``python -m research tables revocable --measured`` reads.
    """
    found = measure_revocable(extract_folders(folders, workers))
    print_and_write(format_revocable({"measured": found}), found, json_file)
