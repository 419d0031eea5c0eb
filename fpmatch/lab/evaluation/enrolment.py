"""Enrolment of several impressions of a finger together, and comparison with fingers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.random import default_rng

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
from fpmatch.lab.evaluation.databases.protocol import Pairs, finger_numbers
from fpmatch.lab.evaluation.report.results import split_scores
from fpmatch.matching.calibration import score_to_fmr
from fpmatch.printable import count

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.lab.evaluation.databases.protocol import Impression
    from fpmatch.lab.evaluation.report.results import EvaluationReport

SCORES_CHECKED: Final = (20.0, 30.0, 40.0)


@dataclass(frozen=True, slots=True)
class Enrolment:
    """Set how many impressions of each finger are enrolled: the first or, with a seed, random ones.

    The prints of the databases `impostors`, of other fingers, are probes. Raises a `DatasetError`
    if `count` is not positive.
    """

    count: int
    seed: int | None = None
    impostors: tuple[Dataset, ...] = ()

    def __post_init__(self) -> None:
        if self.count < 1:
            raise DatasetError(f"at least 1 impression must be enrolled, not {self.count}")


class EnrolmentPlan(NamedTuple):
    """The pairs of each probe with each enrolled finger, within one database.

    The first enrolled impression of a finger represents it, and maps to all of them in `enrolled`.
    """

    pairs: Pairs
    enrolled: Mapping[int, tuple[int, ...]]


def plan_enrolment(
    impressions: Sequence[Impression], enrolment: Enrolment, own: int | None = None
) -> EnrolmentPlan:
    """Choose the impressions to enrol and the pairs to compare, by finger and then probe.

    Fingers with fewer impressions than are to be enrolled are not enrolled; all of their
    impressions are probes. If `own` is given, only fingers of the first `own` impressions are
    enrolled. Raises a `DatasetError` if no finger has more than `enrolment.count` impressions.
    """
    finger = finger_numbers(impressions)
    own = len(finger) if own is None else own
    rng = None if enrolment.seed is None else default_rng(enrolment.seed)
    enrolled: dict[int, tuple[int, ...]] = {}
    for one in np.unique(finger[:own]):
        shown = np.flatnonzero(finger[:own] == one)
        if len(shown) >= enrolment.count:
            chosen = shown if rng is None else rng.permutation(shown)
            first, *others = sorted(chosen[: enrolment.count].tolist())
            enrolled[first] = first, *others
    taken = [k for group in enrolled.values() for k in group]
    probes = np.setdiff1d(np.arange(len(finger)), taken)
    reference = np.repeat(np.array(list(enrolled), np.intp), len(probes))
    probe = np.tile(probes, len(enrolled))
    genuine = finger[probe] == finger[reference]
    if not genuine.any():
        raise DatasetError(
            f"no finger has more than {count(enrolment.count, 'impression')}: nothing is left to "
            "compare"
        )
    return EnrolmentPlan(Pairs(probe, reference, genuine), enrolled)


def with_impostors(extracted: ExtractedSet, others: Sequence[ExtractedSet]) -> ExtractedSet:
    """Return a database with the prints of others after its own, as those of further fingers."""
    impressions: list[Impression] = []
    first = 0
    for one in (extracted, *others):
        fingers = _as_numbers(one.dataset.impressions)
        numbered = zip(one.dataset.impressions, fingers, strict=True)
        impressions += [replace(i, finger=first + finger) for i, finger in numbered]
        first += max(fingers) + 1
    extractions = tuple(e for one in (extracted, *others) for e in one.extractions)
    return ExtractedSet(replace(extracted.dataset, impressions=tuple(impressions)), extractions)


def _as_numbers(impressions: Sequence[Impression]) -> list[int]:
    """Return the fingers of impressions as numbers, those that are names by their order."""
    numbers = [i.finger for i in impressions if isinstance(i.finger, int)]
    return numbers if len(numbers) == len(impressions) else finger_numbers(impressions).tolist()


def enrolment_document(report: EvaluationReport, enrolment: Enrolment) -> dict[str, Any]:
    """Return what was enrolled, and the stated and measured FMR of some scores, as JSON values."""
    genuine, impostor = split_scores(report.sets)
    return {
        "impressions": enrolment.count,
        "seed": enrolment.seed,
        "impostors": [dataset.name for dataset in enrolment.impostors],
        "scores": [
            {
                "score": threshold,
                "stated_fmr": score_to_fmr(threshold),
                "fmr": _share(impostor >= threshold),
                "fnmr": _share(genuine < threshold),
            }
            for threshold in SCORES_CHECKED
        ],
    }


def enrolment_text(document: Mapping[str, Any]) -> str:
    """Return the result of `enrolment_document` as text."""
    which = "the first" if document["seed"] is None else "drawn at random"
    impressions = f"{count(document['impressions'], 'impression')} of each finger, {which}"
    lines = [f"Enrolled: {impressions}. Compared: each other impression with each finger."]
    if document["impostors"]:
        lines.append(f"Impostors, too: the prints of {', '.join(document['impostors'])}.")
    lines += [
        f"Score {row['score']:g}: stated FMR {_percent(row['stated_fmr'])}, measured FMR "
        f"{_percent(row['fmr'])}, FNMR {_percent(row['fnmr'])}"
        for row in document["scores"]
    ]
    return "\n".join(lines)


def _share(chosen: np.ndarray[Any, np.dtype[np.bool_]]) -> float | None:
    return float(np.mean(chosen)) if chosen.size else None


def _percent(rate: float | None) -> str:
    return "-" if rate is None else f"{100 * rate:.3g} %"
