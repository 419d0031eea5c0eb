#!/usr/bin/env python3
"""Measure searches of large galleries of different prints: time, memory, loss of each stage.

.venv/bin/python research/benchmarks/large_galleries.py --keep FOLDER [--most 1000000]
    [--json FILE] DIR...
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import repository  # noqa: F401
from made_gallery import PART, SEED, index_of, segments_of, sensor_of, template_of, template_rows
from scipy.spatial import Delaunay

from fpmatch.gallery.index.loss import chosen_by_ridges, search_rounds, with_ridges, with_votes
from fpmatch.gallery.index.print_segment import MOST_PRINTS, prepare_prints, ridge_agreements
from fpmatch.gallery.index.prints.compact_template import CompactTemplates, prepare_compact
from fpmatch.gallery.index.prints.compare import ridge_agreement, similarities
from fpmatch.gallery.index.prints.descriptor_scores import PRINTS_AT_ONCE, SizeNormalization
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.gallery.index.stages import most_voted, preselect, unoriented_share
from fpmatch.gallery.index.terms import probe_terms
from fpmatch.gallery.search.indexed import MOST_SEGMENTS
from fpmatch.gallery.search.search import MOST_WHOLE
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.prints.bit_descriptors import prefilter_of
from research.commands import PATH, Command, json_file, print_and_write
from research.databases import extract_folders, prints_of
from research.tables.searching import format_searching

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from made_gallery import Rows

    from fpmatch.gallery.index.loss import SearchPlan
    from fpmatch.gallery.index.print_segment import PrintSegment
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.templates.minutiae import Template

    Rounds = Sequence[tuple[SearchPlan, float]]

COUNTS = (10_000, 100_000, 1_000_000, 10_000_000)
MOST_ON_DEMAND = 1_000_000  # more need --most
# losses that are wanted, and thresholds that candidates have to reach: first as by default
WANTED = ((0.01, 0.0), (0.005, 0.0), (0.001, 0.0), (0.005, 70.0))
TIMED_BY_KIND = 2  # probes without a mate
PROBES = 14  # of each kind of prints, of which all mates are looked for; one of each is timed
COMPARED_WITH_ALL = 5  # of each kind
BEHIND = (0.01, 0.001)  # shares of a gallery: mates that rank behind them are counted
RIVALS = 300  # prints that a mate is measured against,
CHECKED = 4_000  # and a mate that is lost
MADE_FINGERS, MADE_IMPRESSIONS = 40, 4  # of synthetic mates
COMPARED = 4096  # of them at once
POINTS, TRIANGULATIONS = 40, 200
MAX_CALLS = {0.005: 1_300, 0.001: 4_000}  # of a search of a million prints, by the loss
MAX_BYTES = 2_200
MAX_LOSS = 0.01


@dataclass(frozen=True)
class Kind:
    """Prints of one kind, of which several are of one finger."""

    name: str
    templates: Sequence[Template]
    finger: Sequence[object]

    @cached_property
    def prints(self) -> list[PreparedTemplate]:
        """The prepared prints."""
        return [MATCHER.prepare(template) for template in self.templates]

    @cached_property
    def segment(self) -> PrintSegment:
        """Their segment of an index."""
        return index_of(self.templates)

    def probes(self, most: int) -> list[int]:
        """Return the prints that are searched for, evenly chosen."""
        return list(range(0, len(self.templates), -(-len(self.templates) // most)))

    def mates(self, probe: int) -> list[int]:
        """Return the other prints of the finger of a print."""
        own = self.finger[probe]
        return [k for k, finger in enumerate(self.finger) if finger == own and k != probe]


@dataclass
class Cost:
    """The processor time of the stages of some searches, in seconds."""

    terms: float = 0.0
    descriptors: float = 0.0
    ridges: float = 0.0
    comparison: float = 0.0

    def timed(self, stage: str, function: Callable[[], Any]) -> Any:
        """Add the processor time of a call to a stage; return its result."""
        start = time.process_time()
        found = function()
        setattr(self, stage, getattr(self, stage) + time.process_time() - start)
        return found

    @property
    def total(self) -> float:
        """All of it."""
        return sum(asdict(self).values())


def triangulation() -> float:
    """Return the processor time of one call of scipy's Delaunay with 40 points."""
    sets = np.random.default_rng(40).random((TRIANGULATIONS, POINTS, 2))
    start = time.process_time()
    for points in sets:
        Delaunay(points)
    return (time.process_time() - start) / TRIANGULATIONS


@dataclass(frozen=True, eq=False)
class Found:
    """The results of a search: scores of the second and third stages, similarities of the last."""

    by_size: SizeNormalization
    descriptors: np.ndarray  # normalized
    scores: np.ndarray  # with votes
    listed: np.ndarray  # scores of the prints that the second stage passes on,
    agreement: np.ndarray  # and how well their ridges agree
    similarities: np.ndarray

    @property
    def score(self) -> float:
        """The greatest score of a print."""
        best = float(self.similarities.max(initial=0.0))
        return load_calibration(MATCHER.name).score(best)


def search(
    segments: Sequence[PrintSegment],
    probe: PreparedTemplate,
    plan: SearchPlan,
    cost: Cost,
    most: int | None = None,
) -> Found:
    """Search a gallery in the stages of a round, as `fpmatch.gallery` does; compare so many."""

    def by_terms() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        share = unoriented_share([segment.terms for segment in segments])
        terms = probe_terms(probe, plan.budget, unoriented=share)
        starts = np.cumsum([0, *map(len, segments)])
        firsts = range(0, len(segments), MOST_SEGMENTS)
        pieces = [[one.terms for one in segments[k : k + MOST_SEGMENTS]] for k in firsts]
        voted = [preselect(piece, terms, plan.by_terms) for piece in pieces]
        found = [starts[k] + place for k, (place, _) in zip(firsts, voted, strict=True)]
        places, votes = np.concatenate(found), np.concatenate([votes for _, votes in voted])
        kept = most_voted(votes, plan.by_terms)
        of = np.searchsorted(starts, places[kept], "right") - 1
        return of, places[kept] - starts[of], votes[kept]

    of, local, votes = cost.timed("terms", by_terms)

    def by_descriptors() -> tuple[np.ndarray, SizeNormalization, np.ndarray, np.ndarray]:
        bounds = np.searchsorted(of, np.arange(len(segments) + 1)).tolist()
        tables = prefilter_of(probe.bit_descriptors)
        parts = [
            (segment.descriptors.scores(tables, places), segment.descriptors.size[places])
            for segment, (a, b) in zip(segments, pairwise(bounds), strict=True)
            for places in (local[a:b],)
        ]
        scores, sizes = map(np.concatenate, zip(*parts, strict=True))
        by_size = SizeNormalization.fit(scores, sizes, len(probe))
        alone = by_size.of(scores, sizes)
        combined = with_votes(alone, votes)
        best = np.argsort(-combined, kind="stable")[: plan.by_descriptors]
        return best, by_size, alone, combined

    def by_ridges() -> np.ndarray:
        if plan.by_ridges >= plan.by_descriptors:  # all are compared
            return np.full(len(best), np.nan)
        parts = [best[k : k + PRINTS_AT_ONCE] for k in range(0, len(best), PRINTS_AT_ONCE)]
        return np.concatenate(
            [ridge_agreements(probe, segments, of[one], local[one]) for one in parts]
        )

    def compared() -> np.ndarray:
        kept = best[chosen_by_ridges(scores[best], agreement, most or plan.by_ridges)]
        return similarities(MATCHER, probe, prepare_prints(segments, of[kept], local[kept]))

    best, by_size, alone, scores = cost.timed("descriptors", by_descriptors)
    agreement = cost.timed("ridges", by_ridges)
    similar = cost.timed("comparison", compared)
    return Found(by_size, alone, scores, scores[best], agreement, similar)


def search_in_rounds(
    segments: Sequence[PrintSegment], probe: PreparedTemplate, rounds: Rounds, cost: Cost
) -> int:
    """Search a gallery until a round ends the search; return the number of rounds."""
    for number, (plan, decisive) in enumerate(rounds, start=1):
        if search(segments, probe, plan, cost).score >= decisive:
            return number
    return len(rounds)


def numbers_of(plan: SearchPlan) -> dict[str, float]:
    """Return the numbers of a plan."""
    return {**asdict(plan), "by_ridges": plan.by_ridges}


def times(
    segments: Sequence[PrintSegment], given: Sequence[Kind], rounds: Rounds, rows: Rows
) -> dict[str, Any]:
    """Return what one search costs without a mate in the gallery, by stage, and with one.

    Times are in milliseconds, and in calls of Delaunay, which are timed before each search. The
    rounds that a search with a mate took are counted. As many packed templates, of the `rows`, as a
    search compares again are prepared and compared.
    """
    again = CompactTemplates.of_bytes(rows[k] for k in range(MOST_WHOLE))

    def compared_again(probe: PreparedTemplate) -> np.ndarray:
        return similarities(MATCHER, probe, prepare_compact(again, np.arange(MOST_WHOLE)))

    cost, mated, count, calls = Cost(), Cost(), sum(map(len, segments)), []
    alone = [kind.prints[k] for kind in given for k in kind.probes(TIMED_BY_KIND)]
    for probe in alone:
        calls.append(triangulation())
        search_in_rounds(segments, probe, rounds, cost)
        cost.timed("comparison", partial(compared_again, probe))
    taken = []
    for kind in given:
        for k in kind.probes(PROBES):
            calls.append(triangulation())
            with_mate = [*segments, kind.segment.take(np.array(kind.mates(k)[:1]))]
            taken.append(search_in_rounds(with_mate, kind.prints[k], rounds, mated))
            mated.timed("comparison", partial(compared_again, kind.prints[k]))
    each, of_mated, call = 1.0 / len(alone), 1.0 / len(taken), float(np.mean(calls))
    return {
        "prints": count,
        "plan": numbers_of(rounds[-1][0]),
        "delaunay_us": 1e6 * call,
        "calls": cost.total * each / call,
        "us_a_print": 1e6 * cost.total * each / count,
        "ms": {name: 1e3 * seconds * each for name, seconds in asdict(cost).items()},
        "mated": {
            "calls": mated.total * of_mated / call,
            "ms": {name: 1e3 * seconds * of_mated for name, seconds in asdict(mated).items()},
            "searches": len(taken),
            "in_rounds": np.bincount(taken, minlength=len(rounds) + 1)[1:].tolist(),
            "rounds": [
                {"score": None if plan is rounds[-1][0] else score, **numbers_of(plan)}
                for plan, score in rounds
            ],
        },
        "bytes": {
            name: sum(a.nbytes for s in segments for a in getattr(s, name).arrays().values())
            / count
            for name in ("terms", "descriptors", "templates")
        },
    }


def better(others: np.ndarray, own: float) -> float:
    """Return how many of `others` are greater than one's own; of equals, half."""
    return float((others > own).sum() + 0.5 * (others == own).sum())


def ridge_rank(
    searched: Found, score: float, agreement: float, plan: SearchPlan
) -> tuple[float, bool]:
    """Return how many prints rank before one by their ridges, and whether it is passed on."""
    among = np.append(searched.listed, score), np.append(searched.agreement, agreement)
    if plan.by_ridges >= plan.by_descriptors:  # all are compared
        return better(searched.listed, score), True
    combined = with_ridges(*among)
    chosen = chosen_by_ridges(*among, plan.by_ridges)
    return better(combined[:-1], float(combined[-1])), len(searched.listed) in chosen


def losses(
    segments: Sequence[PrintSegment], kind: Kind, rounds: Rounds, most: int = PROBES
) -> list[dict[str, Any]]:
    """Return for each mate of each probe how far it comes in a search.

    A mate is searched for among the prints of the gallery, without the other mates: `votes` is the
    number of those with more votes in the last round, `descriptors` and `both` of those with better
    scores among the ones that its first stage passes on, `ridges` of those that its third stage
    ranks before it. `rival` is the greatest similarity of the 300 that rank first, or of 4,000 if
    the mate is lost. `passed` states
    whether the first stage of a round passes the mate on, and `compared` whether it is compared,
    before another print ends the search.
    """
    found = []
    own_prints, calibration = kind.segment, load_calibration(MATCHER.name)
    descriptors = own_prints.descriptors
    for k in kind.probes(most):
        probe, mates = kind.prints[k], np.array(kind.mates(k), np.intp)
        scores, sizes = descriptors.scores(probe)[mates], descriptors.size[mates]
        agreement = ridge_agreement(probe, descriptors, own_prints.templates, mates)
        passed, compared = np.zeros(len(mates), bool), np.zeros(len(mates), bool)
        sought = np.ones(len(mates), bool)
        for plan, decisive in rounds:
            terms = probe_terms(probe, plan.budget)
            votes = np.concatenate([segment.terms.votes(terms) for segment in segments])
            own_votes = own_prints.terms.votes(terms)[mates]
            searched = search(segments, probe, plan, Cost(), RIVALS)
            alone = searched.by_size.of(scores, sizes)
            own = with_votes(alone, own_votes)
            by_votes = np.array([better(votes, v) for v in own_votes])
            by_descriptors = np.array([better(searched.descriptors, v) for v in alone])
            by_both = np.array([better(searched.scores, v) for v in own])
            ranked = [ridge_rank(searched, *one, plan) for one in zip(own, agreement, strict=True)]
            by_ridges, passed_on = map(np.array, zip(*ranked, strict=True))
            in_round = sought & (by_votes < plan.by_terms)
            passed |= in_round
            in_round &= by_both < plan.by_descriptors
            compared |= in_round & passed_on
            sought &= ~compared & (searched.score < decisive)
        similar = [MATCHER.compare(probe, kind.prints[mate]).similarity for mate in mates.tolist()]
        rival = np.full(len(mates), searched.similarities.max(initial=0.0))
        lost = ~compared & (np.array(similar) > rival)
        if lost.any():
            more = replace(plan, by_terms=max(plan.by_terms, CHECKED), by_descriptors=CHECKED)
            rivals = search(segments, probe, more, Cost(), CHECKED).similarities
            rival[lost] = np.maximum(rival[lost], rivals.max(initial=0.0))
        for j, similarity in enumerate(similar):
            found.append(
                {
                    "probe": k,
                    "similarity": similarity,
                    "score": calibration.score(similarity),
                    "rival": float(rival[j]),
                    "votes": float(by_votes[j]),
                    "descriptors": float(by_descriptors[j]),
                    "both": float(by_both[j]),
                    "ridges": float(by_ridges[j]),
                    "passed": bool(passed[j]),
                    "compared": bool(compared[j]),
                }
            )
    return found


def summary(
    name: str, pairs: Sequence[dict[str, Any]], count: int, loss: float, least: float = 0.0
) -> dict[str, Any]:
    """Return the share of the mates that comparing all finds but a search loses, by stage."""
    right = [p for p in pairs if p["similarity"] > p["rival"] and p["score"] >= least]
    size = max(1, len(right))
    shares = np.array([p["votes"] / count for p in right] or [0.0])
    return {
        "prints": name,
        "gallery": count,
        "wanted": loss,
        "threshold": least,
        "mates": len(pairs),
        "found": len(right),
        "lost_by_terms": 1 - sum(p["passed"] for p in right) / size,
        "lost": 1 - sum(p["compared"] for p in right) / size,
        "penetration_for_99_percent": float(np.quantile(shares, 0.99, method="higher")),
        "behind": {
            by: [sum(p[by] >= share * count for p in right) for share in BEHIND]
            for by in ("votes", "descriptors", "both", "ridges")
        },
    }


def compare_all(
    rows: Rows, given: Sequence[Kind], pairs: Sequence[Sequence[dict[str, Any]]]
) -> list[list[dict[str, Any]]]:
    """Return pairs whose rival is the most similar of all prints, each of which is compared."""
    rivals: dict[tuple[int, int], float] = {}
    for first in range(0, len(rows), COMPARED):
        numbers = range(first, min(first + COMPARED, len(rows)))
        many = PreparedPrints.pack(MATCHER.prepare(template_of(rows, k)) for k in numbers)
        for n, kind in enumerate(given):
            for k in kind.probes(COMPARED_WITH_ALL):
                rival = float(similarities(MATCHER, kind.prints[k], many).max())
                rivals[n, k] = max(rivals.get((n, k), 0.0), rival)
    return [
        [{**pair, "rival": rivals[n, pair["probe"]]} for pair in found]
        for n, found in enumerate(pairs)
    ]


def kinds(folders: Sequence[Path]) -> list[Kind]:
    """Return the prints whose mates are looked for: synthetic ones, and those of databases."""
    fingers = range(MADE_FINGERS)
    made: list[Template] = []
    for finger in fingers:
        made += make_templates(SEED + 1, [finger], MADE_IMPRESSIONS, sensors=[sensor_of(finger)])
    given = [Kind("synthetic", made, [f for f in fingers for _ in range(MADE_IMPRESSIONS)])]
    for found_set in extract_folders(folders):
        kept = prints_of(found_set)
        fingers_of = [shown.finger for shown, _ in kept]
        given.append(Kind(found_set.dataset.name, [t for _, t in kept], fingers_of))
    return given


@click.command(cls=Command)
@click.argument("folders", metavar="[DIR]...", nargs=-1, type=PATH)
@click.option(
    "--keep", metavar="FOLDER", type=PATH, required=True, help="Keep the gallery in this folder."
)
@click.option("--most", default=MOST_ON_DEMAND, show_default=True, help="Largest number of prints.")
@click.option(
    "--different",
    metavar="N",
    default=None,
    type=click.IntRange(min=PART),
    help="Make only so many different prints; larger galleries have them repeatedly.",
)
@json_file
@click.pass_context
def main(
    context: click.Context,
    folders: tuple[Path, ...],
    keep: Path,
    most: int,
    different: int | None,
    json_file: Path | None,
) -> None:
    """Measure searches of large galleries: time, memory, and the loss of each stage.

    The gallery's prints are templates of as many different synthetic fingers, made without images.
    They are made once, and kept in FOLDER: about 4.7 kB a print, and a millisecond of one core.
    For 10,000, 100,000 and 1,000,000 of them (others by --most) are printed, for four pairs of a
    wanted loss and a threshold: processor time of one search, with a mate in the gallery and
    without, in calls of scipy's Delaunay with 40 points and by stage; bytes a print; time to open.
    With --different, a larger gallery has the same files several times: its searches take their
    time, but its losses are not measured.

    The loss is measured on synthetic fingers and on each FVC-style database DIR: each probe is
    searched for in the gallery, once for each of its mates. A mate counts where it is more similar
    than the 300 likeliest other prints, one that is lost than the 4,000 likeliest: so do all that
    comparing all would find, and some that it would not. In a gallery of 65,536, all prints are
    compared, which shows what that changes. The exit status is 1 where a search for a mate in a
    million prints with a loss of 0.5 % takes more than 1,300 calls, of 0.1 % more than 4,000, a
    print more than 2,200 bytes, or more than 1 % of the mates of a database are lost.
    """
    given = kinds(folders)
    speed, lost = [], []
    parts = -(-(different or most) // PART)
    for count in sorted({c for c in COUNTS if c < most} | {most}):
        numbers = [part % parts for part in range(-(-count // PART))]
        for part in dict.fromkeys(numbers):
            segments_of(keep, part)  # made where they are missing
        start = time.process_time()
        segments = [segment for part in numbers for segment in segments_of(keep, part)]
        opening = time.process_time() - start
        del segments[-(-count // MOST_PRINTS) :]
        segments[-1] = segments[-1].take(np.arange(count - MOST_PRINTS * (len(segments) - 1)))
        for wanted, least in WANTED:
            rounds = search_rounds(wanted, count, least)
            taken = times(segments, given, rounds, template_rows(keep, 0))
            of = min(count, parts * PART)  # different prints
            speed.append({**taken, "threshold": least, "different": of, "open_s": opening})
            click.echo(
                f"{count:,} prints, {wanted:.1%}: {taken['mated']['calls']:.0f} calls", err=True
            )
            if len(numbers) <= parts:
                pairs_of = ((k.name, losses(segments, k, rounds)) for k in given)
                lost += [summary(name, pairs, count, wanted, least) for name, pairs in pairs_of]
    usual, first = WANTED[0][0], segments_of(keep, 0)
    rounds = search_rounds(usual, PART)
    pairs = [losses(first, kind, rounds, COMPARED_WITH_ALL) for kind in given]
    exact = compare_all(template_rows(keep, 0), given, pairs)
    results = {
        "speed": speed,
        "loss": lost,
        "bound": [summary(k.name, p, PART, usual) for k, p in zip(given, pairs, strict=True)],
        "exact": [summary(k.name, p, PART, usual) for k, p in zip(given, exact, strict=True)],
    }
    print_and_write(format_searching(results), results, json_file)
    of_a_million = (s for s in speed if s["prints"] <= MOST_ON_DEMAND and not s["threshold"])
    slow = any(
        s["mated"]["calls"] > MAX_CALLS[s["plan"]["loss"]]
        for s in of_a_million
        if s["plan"]["loss"] in MAX_CALLS
    )
    large = any(sum(s["bytes"].values()) > MAX_BYTES for s in speed)
    context.exit(int(slow or large or any(r["lost"] > MAX_LOSS for r in lost)))


if __name__ == "__main__":
    main()
