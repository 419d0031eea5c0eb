"""Search of the best alignment: which hypotheses are tried and refined, and which one is taken."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import COMPILED, doubled_prints, seeds
from matching_weights import ALWAYS, NEVER, all_with, some_weights

from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from fpmatch.matching.pipeline._kernels._ridge_kernel import RidgeCorrelator
from fpmatch.matching.pipeline._kernels._ridge_search_kernel import RidgeSearch
from fpmatch.matching.pipeline.alignment import (
    AlignmentParameters,
    LocalParameters,
    RidgeSearchParameters,
    aligner_of,
    index_neighbours,
    kept_alignment,
    local_similarity,
    make_aligner,
)
from fpmatch.matching.pipeline.evidence import evidence_scorer, gather_evidence
from fpmatch.matching.pipeline.match import match
from fpmatch.matching.prints.bit_descriptors import prefilter


def alignment_twin(a, b, weights):
    """Return the best alignment, its sum, and how many were refined, as `match` describes it."""
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    model = weights.model_of(a, b)

    def sum_of(alignment, refine):
        scorer = evidence_scorer(max(len(a), len(b)), all_with(weights, refine_threshold=refine))
        return gather_evidence(a, b, alignment, similarity, scorer).total

    aligner = aligner_of(a.points, b.points)
    aligner.relax(similarity)
    weak = aligner.relaxation.strength < model.relaxation_threshold
    coarse = {}
    for k in range(AlignmentParameters().hypotheses):
        if aligner.start_hypothesis(k):
            found = kept_alignment(aligner, k)
            coarse[k] = found, sum_of(found, NEVER)
            if coarse[k][1] > model.confident_threshold:
                coarse = {k: coarse[k]} if coarse[k][1] > model.refine_threshold else coarse
                break
            if weak:
                break
    passing = [k for k, (_, total) in coarse.items() if total > model.refine_threshold]
    refined = [kept_alignment(aligner, k) for k in passing if aligner.refine(k)]
    rows = [(one, sum_of(one, ALWAYS)) for one in refined]
    if not passing:
        rows = list(coarse.values())
    totals = [total for _, total in [*coarse.values(), *rows]]
    shown = a.region.ridges is not None and b.region.ridges is not None
    if shown and not max(totals, default=-math.inf) > model.confident_threshold:
        search, correlator = RidgeSearch(RidgeSearchParameters()), RidgeCorrelator(len(b))
        sides = a.for_kernels(), b.for_kernels()
        if model is weights.models[3]:
            found_by_ridges = search.search(*sides, correlator)
        else:
            found_by_ridges = search.search_candidates(*sides, aligner.relaxation, correlator)
        for k in range(found_by_ridges):
            row = aligner.hypotheses + k
            if aligner.start_from(search.first[k], search.second[k], row):
                found = kept_alignment(aligner, row)
                rows.append((found, sum_of(found, ALWAYS)))
    if not rows:
        return None
    return *max(rows, key=lambda row: row[1]), len(refined)


@given(
    seeds,
    st.sampled_from([ALWAYS, NEVER, -20.0, -8.0, -2.0, 3.0]),
    st.sampled_from([-math.inf, -5.0, 0.0, 5.0, math.inf]),
    st.sampled_from([-1.0, 0.01, 0.05, 0.2, math.inf]),
)
@settings(max_examples=50 if COMPILED else 15)
def test_match_agrees_with_its_twin(seed, refine, confident, relaxation):
    """Which hypotheses are tried, which are refined, and which of them is the result."""
    a, b = doubled_prints(seed)
    weights = some_weights(refine, confident=confident, relaxation=relaxation, apart=2.0)
    found = match(a, b, evidence_scorer(max(len(a), len(b)), weights))
    expected = alignment_twin(a, b, weights)
    assert (found is None) == (expected is None)
    if found is not None:
        for name in ("partner", "transform", "predicted"):
            assert getattr(found[0], name).tolist() == getattr(expected[0], name).tolist()
        assert found[1].total == expected[1]


def test_the_cases_to_align_are_of_every_kind():
    """Several hypotheses are tried; the first is not always the best; some sums are confident."""
    refined, first_is_best, one_alone = [], [], []
    for seed in range(30 if COMPILED else 9):
        a, b = doubled_prints(seed)
        every, first, confident = (
            alignment_twin(a, b, some_weights(relaxation=relaxation, confident=sure))
            for relaxation, sure in ((-1.0, math.inf), (math.inf, math.inf), (-1.0, 0.0))
        )
        if None in {every, first, confident}:
            continue
        refined.append(every[2])
        first_is_best.append(every[0].partner.tolist() == first[0].partner.tolist())
        one_alone.append(confident[2] == 1 < every[2])
    assert max(refined) > 1
    assert 0 < sum(first_is_best) < len(first_is_best)
    assert any(one_alone)


@pytest.mark.parametrize("hypotheses", [1, 16, 17, 40])
def test_any_number_of_hypotheses_can_be_asked_for(hypotheses):
    a, b = doubled_prints(2)
    room, parameters = max(len(a), len(b)), AlignmentParameters(hypotheses=hypotheses)
    aligners = [make_aligner(room, room, parameters) for _ in range(2)]
    scorer, search = evidence_scorer(room, some_weights()), RidgeSearch(RidgeSearchParameters())
    pipeline = Pipeline(room, prefilter(), *aligners, scorer, search, LocalParameters())
    pipeline.load(a.for_kernels())
    pipeline.neighbours = index_neighbours(a.neighbourhoods)
    assert math.isfinite(pipeline.match_with(b.for_kernels(), False))
    assert pipeline.best >= 0
