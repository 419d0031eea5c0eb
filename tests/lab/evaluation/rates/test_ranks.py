from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.lab.evaluation.databases.dataset import Impression, choose_pairs
from fpmatch.lab.evaluation.rates.scores import ScoresSet, Trials, ranks_of


def prints(fingers):
    return [Impression(f, k, Path(f"{f}_{k}.tif")) for k, f in enumerate(fingers)]


def identified(impressions, pairs, similarity):
    names = tuple(i.path.name for i in impressions)
    fingers, number = np.unique([i.finger for i in impressions], return_inverse=True)
    trials = Trials(similarity, number[pairs.probe], number[pairs.reference], fingers.size)
    compared = np.ones(len(pairs), bool)
    return ranks_of(ScoresSet("m", "s", names, pairs.probe, pairs.reference, trials, compared))


def slow_ranks(impressions, pairs, similarity):
    """Search probe by probe, as the protocol is told."""
    of = {}
    for i, j, s in zip(pairs.probe, pairs.reference, similarity, strict=True):
        of[i, j] = of[j, i] = s
    for i, probe in enumerate(impressions):
        best = {}
        for j, other in enumerate(impressions):
            if j != i:
                best[other.finger] = max(best.get(other.finger, -np.inf), of[i, j])
        if probe.finger in best:
            own = best.pop(probe.finger)
            yield 1 + sum(b >= own for b in best.values())


@given(st.lists(st.integers(1, 5), min_size=2, max_size=12), st.randoms(use_true_random=False))
def test_agrees_with_searching_probe_by_probe(fingers, random):
    impressions = prints(fingers)
    pairs = choose_pairs(impressions)
    similarity = np.array([float(random.randint(0, 6)) for _ in range(len(pairs))])
    found = identified(impressions, pairs, similarity)
    if len(set(fingers)) < 2 or len(set(fingers)) == len(fingers):
        assert found is None
        return
    rank, finger = found
    assert rank.tolist() == list(slow_ranks(impressions, pairs, similarity))
    numbered = sorted(set(fingers))
    mated = [f for f in fingers if fingers.count(f) > 1]
    assert [numbered[k] for k in finger] == mated


def test_first_impressions_alone_are_no_search():
    impressions = prints([1, 1, 2, 2])
    pairs = choose_pairs(impressions, "fvc")
    assert identified(impressions, pairs, np.zeros(len(pairs))) is None
