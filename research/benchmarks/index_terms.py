#!/usr/bin/env python3
"""Measure the first stages of searches of large galleries: bytes, time, mates lost.

.venv/bin/python research/benchmarks/index_terms.py [--prints 20000] [--json FILE] DIR...
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import repository  # noqa: F401
from scipy.spatial import Delaunay

from fpmatch.gallery.index.loss import LEAST_PASSED_ON, search_plan, with_votes
from fpmatch.gallery.index.segment import MAX_PRINTS, Segment
from fpmatch.gallery.index.stages import most_voted, preselect, unoriented_share
from fpmatch.gallery.index.terms import probe_terms
from fpmatch.lab.evaluation.databases.extraction import extract_datasets
from fpmatch.lab.evaluation.run import load_datasets
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.prints.candidate_list import SizeNormalization, prefilter_scores
from fpmatch.matching.prints.prepared_prints import PreparedPrints
from research.commands import Command, folders, json_file, write_json
from research.tables.searching import format_indexing
from research.training.index import PASSED_ON, gallery_prints, segment_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.matching.prints.prepare import PreparedTemplate

GALLERIES = (100_000, 1_000_000)
LOSSES = (0.005, 0.01, 0.02, 0.05)
SPEED_LOSS = 0.01
POINTS = 40
CALLS = 200
PROBES = 8


@dataclass(frozen=True)
class Kind:
    """The prints of one database, and their fingers."""

    name: str
    prints: Sequence[PreparedTemplate]
    finger: Sequence[object]


@dataclass(frozen=True)
class Others:
    """Prints of other fingers, among which mates are ranked."""

    packed: PreparedPrints
    segment: Segment


def lost(kind: Kind, others: Others, every: int) -> dict[str, Any]:
    """Return the shares of the mates of a database that the stages lose.

    A mate counts if it is more similar than all prints of other fingers of the database, and in a
    gallery of N prints by the probability that none of them, of its FMR, scores higher.
    """
    own, packed = segment_of(list(kind.prints)), PreparedPrints.pack(kind.prints)
    finger = np.array([hash(f) for f in kind.finger])
    calibration = load_calibration(MATCHER.name)
    budgets = sorted({search_plan(loss, n).budget for loss in LOSSES for n in GALLERIES})
    score: list[float] = []
    shares: list[list[tuple[float, float]]] = []
    for k in range(0, len(packed), every):
        probe, mates = kind.prints[k], np.flatnonzero(finger == finger[k])
        similarity = MATCHER.similarities(probe, packed)
        best = similarity[finger != finger[k]].max(initial=0)
        mates = mates[(mates != k) & (similarity[mates] > best)]
        descriptors, sizes = prefilter_scores(probe, others.packed), others.segment.size
        of_mates, of_sizes = prefilter_scores(probe, packed)[mates], own.size[mates]
        ranked = []
        for budget in budgets:
            terms = probe_terms(probe, budget)
            votes, for_mates = others.segment.votes(terms), own.votes(terms)[mates]
            passed = votes >= np.quantile(votes, 1 - PASSED_ON)
            by_size = SizeNormalization.fit(descriptors[passed], sizes[passed], len(probe))
            combined = with_votes(by_size.of(descriptors, sizes), votes)
            both = with_votes(by_size.of(of_mates, of_sizes), for_mates)
            ranked.append((before(votes, for_mates), before(combined, both)))
        score += calibration.scores(similarity[mates]).tolist()
        shares += np.array(ranked).transpose(2, 0, 1).tolist()
    share, scores = np.array(shares).reshape(-1, len(budgets), 2), np.array(score)
    return {
        "prints": kind.name,
        "galleries": [of_gallery(share, scores, budgets, n) for n in GALLERIES],
    }


def of_gallery(
    shares: np.ndarray, scores: np.ndarray, budgets: list[float], prints: int
) -> dict[str, Any]:
    """Return the losses of the mates, as far as they count in a gallery of so many prints."""
    rows = []
    weights = np.exp(-prints * 10 ** (-0.1 * scores))
    for loss in LOSSES:
        plan = search_plan(loss, prints)
        at = shares[:, budgets.index(plan.budget)]
        missed = at > np.array([plan.by_terms, plan.by_descriptors]) / prints
        lost = np.average(np.stack([missed[:, 0], missed.any(1)]), axis=1, weights=weights)
        rows.append(lost.tolist())
    return {"prints": prints, "mates": round(float(weights.sum())), "lost": rows}


def plan_of(loss: float, prints: int) -> list[float]:
    """Return the budget of a plan, and how many prints its stages pass on."""
    plan = search_plan(loss, prints)
    return [plan.budget, plan.by_terms, plan.by_descriptors]


def before(others: np.ndarray, mates: np.ndarray) -> np.ndarray:
    """Return the share of the others that rank as high as each of the mates."""
    return 1 - np.searchsorted(np.sort(others), mates, "left") / len(others)


def speed(others: Others, prints: Sequence[PreparedTemplate], count: int) -> dict[str, float]:
    """Return what the first stage costs in a gallery of so many prints."""
    segments = [copy_of(others.segment) for _ in range(-(-count // len(others.segment)))]
    size = sum(map(len, segments))
    plan = search_plan(SPEED_LOSS, size)
    probes = [prints[k * len(prints) // PROBES] for k in range(PROBES)]
    points = np.random.default_rng(1).uniform(0, 300, (POINTS, 2))
    spent, calls = [], []
    for probe in probes:
        start = time.process_time()
        terms = probe_terms(probe, plan.budget, unoriented=unoriented_share(segments))
        voted = [preselect(segment, terms, plan.by_terms)[1] for segment in segments]
        most_voted(np.concatenate(voted), plan.by_terms)
        spent.append(time.process_time() - start)
        start = time.process_time()
        for _ in range(CALLS):
            Delaunay(points)
        calls.append((time.process_time() - start) / CALLS)
    return {
        "prints": size,
        "budget": plan.budget,
        "passed_on": plan.by_terms,
        "compared": plan.by_descriptors,
        "ms": 1e3 * float(np.median(spent)),
        "delaunay_calls": float(np.median(spent) / np.median(calls)),
    }


def copy_of(segment: Segment) -> Segment:
    """Return a segment in memory of its own, so that none is found in a cache."""
    return Segment.of_arrays({name: array.copy() for name, array in segment.arrays().items()})


def bytes_a_print(kind: Kind) -> dict[str, float | str]:
    """Return what the index of a database's prints takes, in a full segment."""
    arrays = segment_of(list(kind.prints)).arrays()
    fixed = arrays.pop("term_start").nbytes / MAX_PRINTS
    each = sum(array.nbytes for array in arrays.values()) / len(kind.prints)
    return {"prints": kind.name, "bytes": each + fixed}


def measured(kinds: Sequence[Kind], prints: int, every: int = 1) -> dict[str, Any]:
    """Return all results."""
    made = list(gallery_prints(prints))
    others = Others(PreparedPrints.pack(made), segment_of(made))
    probes = [print_ for kind in kinds for print_ in kind.prints]
    return {
        "others": prints,
        "losses": LOSSES,
        "least": LEAST_PASSED_ON,
        "plans": [[plan_of(loss, n) for loss in LOSSES] for n in GALLERIES],
        "loss": [lost(kind, others, every) for kind in kinds],
        "bytes": [bytes_a_print(kind) for kind in kinds],
        "speed": [speed(others, probes, count) for count in GALLERIES],
    }


@click.command(cls=Command)
@folders
@click.option("--prints", default=20_000, show_default=True, help="Prints of other fingers.")
@json_file
def main(folders: tuple[Path, ...], prints: int, json_file: Path | None) -> None:
    """Measure the first stages of searches of large galleries on the FVC-style databases DIR.

    Each print is searched for among synthetic prints of other fingers, once for each of its mates
    that comparing all prints would find. Printed are the shares of the mates that the first stage
    loses, and the first two together, with the plan for each wanted loss; bytes a print of the
    index; and processor time of the first stage, for which the prints are repeated.
    """
    kinds = []
    for found in extract_datasets(load_datasets(folders)):
        pairs = zip(found.dataset.impressions, found.extractions, strict=True)
        kept = [(i.finger, MATCHER.prepare(e.template)) for i, e in pairs if e.template is not None]
        kinds.append(Kind(found.dataset.name, [p for _, p in kept], [f for f, _ in kept]))
    results = measured(kinds, prints)
    click.echo(format_indexing(results))
    if json_file:
        write_json(json_file, results)


if __name__ == "__main__":
    main()
