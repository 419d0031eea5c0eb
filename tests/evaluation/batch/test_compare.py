"""`fpmatch.evaluation.batch.compare`: one probe with many at once, or pair by pair: the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fpmatch.evaluation.batch import compare as scoring_compare
from fpmatch.evaluation.batch.compare import Bench, ComparisonTask, compare_pairs
from fpmatch.evaluation.batch.plan import AllPairs, PairChunk
from fpmatch.evaluation.batch.sources import pack
from fpmatch.matching.matchers import get_matcher


class OneByOne:
    """The default matcher without its way to compare many at once."""

    name = "one by one"

    def __init__(self):
        matcher = get_matcher("unit-circle")
        self.prepare, self.compare = matcher.prepare, matcher.compare


def packed(template, rng, count):
    """Return disturbed templates, in bytes; the one of number 1 is missing."""
    found = {}
    for number in range(count):
        m = template.minutiae.take(np.sort(rng.permutation(len(template.minutiae))[:20]))
        found[number] = pack(replace(template, minutiae=m))
    return {number: data for number, data in found.items() if number != 1}


def test_many_at_once_are_as_one_by_one(template, rng, monkeypatch):
    probes, references = packed(template, rng, 3), packed(template, rng, 5)
    (chunk,) = AllPairs(3, 5).chunks()
    task = ComparisonTask(chunk, probes, references)
    monkeypatch.setattr(scoring_compare, "PREPARED_HELD", 2)
    found = compare_pairs(Bench(get_matcher("unit-circle")), task)
    assert found.tobytes() == compare_pairs(Bench(OneByOne()), task).tobytes()
    missing = (chunk.probe == 1) | (chunk.reference == 1)
    assert np.isnan(found).tolist() == missing.tolist()

    order = rng.permutation(len(chunk))
    listed = PairChunk(chunk.probe[order], chunk.reference[order])
    shuffled = compare_pairs(Bench(get_matcher("unit-circle")), replace(task, pairs=listed))
    assert shuffled.tobytes() == found[order].tobytes()


def test_a_bench_packs_a_band_once(template, rng):
    bench = Bench(get_matcher("unit-circle"))
    templates = list(packed(template, rng, 4).values())
    first = bench.pack(templates)
    assert bench.pack(list(templates)) is first
    assert bench.pack(templates[1:]) is not first
