"""Comparisons of impressions whose fingers are known, from which the score's weights are fitted."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.evaluation.databases.dataset import choose_pairs
from fpmatch.matching.matchers.unit_circle import MATCHER, view_of
from fpmatch.matching.parameters import USUAL
from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from fpmatch.matching.pipeline.evidence import (
    AMOUNTS,
    FEATURES,
    MODELS,
    ScoreModel,
    ScoreWeights,
)
from fpmatch.matching.prints.prepare import prefilter_of, score_descriptors
from fpmatch.matching.reference.neighbourhood import local_similarity
from research.databases import without_ridges
from research.partial_templates import window

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.matching.prints.prepared import PreparedTemplate

SEED: Final = 18
LOCAL_HYPOTHESES: Final = USUAL.hypotheses
HYPOTHESES: Final = LOCAL_HYPOTHESES + USUAL.ridge_starts
NO_QUANTILES: Final = ((0.0,) * len(AMOUNTS), (1.0, *(0.0,) * (len(AMOUNTS) - 1)))
"""Quantiles that do not depend on the amount of evidence."""
NO_PREFILTER: Final = (-1.0, 0.0, -1.0)  # a threshold that all prints pass


@dataclass(frozen=True, slots=True)
class SampleParameters:
    """Set which comparisons are made.

    `every_impostor`, `every_window_impostor`: one of so many impostor comparisons of a database is
    made, and one of a window. `windows_px`: sides of the windows in pixels at 500 dpi.
    """

    every_impostor: int = 4
    every_window_impostor: int = 16
    windows_px: tuple[int, ...] = (128, 160)


@dataclass(frozen=True, slots=True, eq=False)
class ScoreSample:
    """The comparisons of one database.

    `name`: the database. `features` (N, H, 11): those of the comparisons that found something, of
    each hypothesis, refined, its ridges compared; NaN where there are fewer. See
    `fpmatch.matching.pipeline.evidence.FEATURES`. `coarse` (N, H, 11): those in coarse
    alignment, of the minutiae alone. `descriptors` (N, 2): the prefilter's score, and the minutiae
    of the smaller print. `strength` (N,): that of the relaxed local matches. `genuine` (N,):
    whether both prints are of one finger. `nothing`: numbers of the other genuine and impostor
    comparisons.
    """

    name: str
    features: NDArray[np.float64]
    coarse: NDArray[np.float64]
    descriptors: NDArray[np.float64]
    strength: NDArray[np.float64]
    genuine: NDArray[np.bool_]
    nothing: tuple[int, int]


def sample_of(
    extracted: Dataset,
    parameters: SampleParameters | None = None,
    *,
    ridges: bool = True,
    window_px: float | None = None,
) -> ScoreSample:
    """Compare the impressions of a database with one another; all must have a ridge field.

    With `window_px`, windows of that side at 500 dpi are cut from the probes.
    """
    p = parameters or SampleParameters()
    pairs = choose_pairs(extracted.impressions)
    templates = [
        one if one is None or ridges else without_ridges(one) for one in extracted.templates
    ]
    every = p.every_impostor
    prints = probes = [None if one is None else MATCHER.prepare(one) for one in templates]
    if window_px is not None:
        every = p.every_window_impostor
        rng = np.random.default_rng([SEED, round(window_px)])
        parts = (None if one is None else window(one, window_px, rng) for one in templates)
        probes = [None if one is None else MATCHER.prepare(one) for one in parts]
    room = max((len(one) for one in prints if one is not None), default=0)
    pipeline = Pipeline(room, USUAL, _no_weights())
    rows: list[NDArray[np.float64]] = []
    descriptors, strength, genuine, nothing, passed = [], [], [], [0, 0], 0
    for i, j, same in zip(pairs.probe, pairs.reference, pairs.genuine, strict=True):
        passed += not same
        if not same and passed % every:
            continue
        a, b = probes[i], prints[j]
        row = None if a is None or b is None else _features(a, b, pipeline)
        if a is None or b is None or row is None:
            nothing[0 if same else 1] += 1
        else:
            rows.append(row[0])
            strength.append(row[1])
            descriptors.append(_descriptors_of(a, b))
            genuine.append(bool(same))
    shape = (len(rows), 2, HYPOTHESES, len(FEATURES))
    features = np.array(rows).reshape(shape)
    return ScoreSample(
        extracted.name,
        features[:, 1],
        features[:, 0],
        np.array(descriptors, np.float64).reshape(-1, 2),
        np.array(strength, np.float64),
        np.array(genuine, bool),
        (nothing[0], nothing[1]),
    )


def samples_of(
    sets: Sequence[Dataset],
    parameters: SampleParameters | None = None,
    *,
    workers: int | None = None,
) -> tuple[list[ScoreSample], list[ScoreSample], list[ScoreSample]]:
    """Return samples with ridges, on minutiae alone, and of windows against whole prints."""
    p = parameters or SampleParameters()
    with ProcessPoolExecutor(workers) as pool:
        with_ridges, alone = (
            list(pool.map(partial(sample_of, parameters=p, ridges=ridges), sets))
            for ridges in (True, False)
        )
        windows = [
            sample
            for side in p.windows_px
            for sample in pool.map(partial(sample_of, parameters=p, window_px=side), sets)
        ]
    return with_ridges, alone, windows


def _no_weights() -> ScoreWeights:
    """Return weights of 0."""
    standard = np.zeros((4, len(FEATURES)))
    standard[1] = 1.0
    model = ScoreModel(standard, 0.0, NO_PREFILTER, -1.0, np.inf, np.inf, np.array(NO_QUANTILES))
    return ScoreWeights((model,) * len(MODELS), {})


def _descriptors_of(probe: PreparedTemplate, reference: PreparedTemplate) -> tuple[int, int]:
    """Return the prefilter's score of two prints, and the minutiae of the smaller."""
    a, b = sorted((probe, reference), key=lambda side: side.key)
    score = score_descriptors(prefilter_of(a.bit_descriptors), b.bit_descriptors)
    return score, min(len(a), len(b))


def _features(
    probe: PreparedTemplate, reference: PreparedTemplate, pipeline: Pipeline
) -> tuple[NDArray[np.float64], float] | None:
    """Return the features of two prints, coarse and refined, (2, H, 11), and local strength."""
    a, b = sorted((probe, reference), key=lambda side: side.key)
    if not (len(a) and len(b)):
        return None
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    sides = view_of(a), view_of(b)
    aligner, scorer, search = pipeline.aligner, pipeline.scorer, pipeline.search
    aligner.load(a.points, len(a), b.points, len(b))
    aligner.relaxation.load(a.points, len(a), b.points, len(b), similarity)
    scorer.choose_model(*sides)
    found = np.full((2, HYPOTHESES, len(FEATURES)), np.nan)
    steps: tuple[Callable[[int], int], ...] = (aligner.start_hypothesis, aligner.refine)
    for refined, (step, rows) in enumerate(zip(steps, found, strict=True)):
        for k, row in enumerate(rows[:LOCAL_HYPOTHESES]):
            if step(k):
                scorer.weigh(*sides, aligner, similarity, bool(refined), k)
                row[:] = scorer.feature
    if all(side.region.ridges is not None for side in (a, b)):
        correlator = scorer.correlator
        for k in range(search.search(*sides, aligner.relaxation, scorer.is_small, correlator)):
            if aligner.start_from(search.first[k], search.second[k], LOCAL_HYPOTHESES + k):
                scorer.weigh(*sides, aligner, similarity, True, LOCAL_HYPOTHESES + k)
                found[1, LOCAL_HYPOTHESES + k] = scorer.feature
    if np.isnan(found[1, :, 0]).all():
        return None
    return found, aligner.relaxation.strength
