"""Shortlists: the mate comes first, parts are as the whole, and prints of any size are ranked."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import COMPILED, jittered, moved, spread_points, template_of, templates

from fpmatch.matching.bit_descriptors import descriptor_similarity
from fpmatch.matching.candidate_list import SIZE_OFFSET, candidate_list, prefilter_scores
from fpmatch.matching.packed_templates import PackedTemplates
from fpmatch.matching.prepare import prepare

EXAMPLES = 6 if COMPILED else 3


@given(templates(), st.lists(templates(), max_size=3))
@settings(max_examples=EXAMPLES)
def test_weights_are_those_of_each_alone(probe, references):
    prints = [prepare(template) for template in [*references, probe]]
    weights = prefilter_scores(prints[-1], PackedTemplates.pack(prints))
    assert weights.tolist() == [
        descriptor_similarity(prints[-1].bit_descriptors, one.bit_descriptors) for one in prints
    ]


def test_the_mate_is_first_and_parts_are_as_the_whole():
    rng = np.random.default_rng(7)
    finger = spread_points(rng, 30)
    others = [template_of(spread_points(rng, 30)) for _ in range(40)]
    mate = template_of(jittered(rng, moved(finger[:, 4:], 1.0, 20 - 9j), 2.0, 0.08))
    many = PackedTemplates.pack(map(prepare, [*others, mate]))
    probe = prepare(template_of(finger))
    whole = prefilter_scores(probe, many)
    assert np.argmax(whole) == 40
    assert whole[40] > 2 * whole[:40].max()
    parts = [prefilter_scores(probe, many, 0, 13), prefilter_scores(probe, many, 13)]
    assert np.concatenate(parts).tolist() == whole.tolist()
    assert prefilter_scores(probe, many, 30, 20).size == 0
    assert candidate_list(probe, many, 1).tolist() == [40]
    rank = whole / (np.diff(many.minutiae_start) + SIZE_OFFSET)
    ten = candidate_list(probe, many, 10)
    assert ten.tolist() == sorted(np.argsort(-rank, kind="stable")[:10].tolist())
    assert candidate_list(probe, many, 99).tolist() == list(range(41))
    assert candidate_list(probe, many, 0).size == 0


@pytest.mark.parametrize("n", [0, 1, 2, 65, 200, 255])
def test_prints_of_any_size(n):
    rng = np.random.default_rng(n)
    sizes = [n, 30, 0] if COMPILED else [min(n, 70), 12, 0]
    prints = [prepare(template_of(spread_points(rng, k, 9.0, 400.0), size=500)) for k in sizes]
    weights = [prefilter_scores(one, PackedTemplates.pack(prints)) for one in prints]
    assert all(found.shape == (3,) and found[2] == 0 for found in weights)
    if n >= 65:
        assert weights[0].argmax() == 0
        assert weights[0][0] > 0
    nobody = PackedTemplates.pack([])
    assert (
        prefilter_scores(prints[0], nobody).size == candidate_list(prints[0], nobody, 5).size == 0
    )
