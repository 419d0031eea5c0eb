from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.lab.evaluation.databases.protocol import PROTOCOLS, Impression, choose_pairs


def impressions(*fingers_and_numbers):
    return [Impression(f, n, Path(f"{f}_{n}.tif")) for f, n in fingers_and_numbers]


FVC_SET_B = impressions(*((f, n) for f in range(101, 111) for n in range(1, 9)))


@pytest.mark.parametrize(("protocol", "impostors"), [("extended", 2880), ("fvc", 45)])
def test_counts_on_a_set_b(protocol, impostors):
    pairs = choose_pairs(FVC_SET_B, protocol)
    assert pairs.genuine.sum() == 280
    assert (~pairs.genuine).sum() == impostors
    assert len(pairs) == 280 + impostors


def slow_pairs(prints, protocol):
    """The definition, pair by pair."""
    first = {f: min(i.number for i in prints if i.finger == f) for f in {i.finger for i in prints}}
    for (a, p), (b, q) in combinations(enumerate(prints), 2):
        genuine = p.finger == q.finger
        both_first = p.number == first[p.finger] and q.number == first[q.finger]
        if genuine or protocol == "extended" or both_first:
            yield a, b, genuine


@given(
    st.lists(st.tuples(st.integers(1, 4), st.integers(1, 5)), unique=True, max_size=12),
    st.sampled_from(PROTOCOLS),
)
def test_agrees_with_the_definition(prints, protocol):
    prints = impressions(*prints)
    pairs = choose_pairs(prints, protocol)
    columns = (pairs.probe.tolist(), pairs.reference.tolist(), pairs.genuine.tolist())
    assert list(zip(*columns, strict=True)) == list(slow_pairs(prints, protocol))
