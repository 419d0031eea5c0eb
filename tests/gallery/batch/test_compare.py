"""`fpmatch.gallery.batch.run`: one probe with many at once, or pair by pair: the same."""

from dataclasses import replace

import numpy as np

from fpmatch.gallery.batch import comparer as comparer_module
from fpmatch.gallery.batch.plan import AllPairs, PairChunk
from fpmatch.gallery.batch.run import BytesComparer, ComparisonTask, compare_pairs
from fpmatch.gallery.batch.sources import pack
from fpmatch.matching.registry import get_matcher
from fpmatch.matching.result import Matcher


class OneByOne(Matcher):
    """The default matcher without its way to compare many at once."""

    name = "one by one"

    def prepare(self, template):
        return get_matcher("unit-circle").prepare(template)

    def compare(self, probe, reference):
        return get_matcher("unit-circle").compare(probe, reference)

    def amount(self, prepared, factor=1.0):
        return get_matcher("unit-circle").amount(prepared, factor)

    def typical_similarities(self, probe, references):
        return get_matcher("unit-circle").typical_similarities(probe, references)


def packed(template, rng, count):
    """Return disturbed templates, in bytes; the one of number 1 is missing."""
    found = {}
    for number in range(count):
        m = template.minutiae.take(np.sort(rng.permutation(len(template.minutiae))[:20]))
        found[number] = pack(replace(template, minutiae=m))
    return {number: data for number, data in found.items() if number != 1}


def test_many_at_once_are_as_one_by_one(template, rng):
    probes, references = packed(template, rng, 3), packed(template, rng, 5)
    (chunk,) = AllPairs(3, 5).chunks()
    task = ComparisonTask(chunk, probes, references)
    found = compare_pairs(BytesComparer(get_matcher("unit-circle"), capacity=2), task)
    assert found.tobytes() == compare_pairs(BytesComparer(OneByOne()), task).tobytes()
    missing = (chunk.probe == 1) | (chunk.reference == 1)
    assert np.isnan(found).tolist() == [missing.tolist()] * 2

    order = rng.permutation(len(chunk))
    listed = PairChunk(chunk.probe[order], chunk.reference[order])
    shuffled = compare_pairs(BytesComparer(get_matcher("unit-circle")), replace(task, pairs=listed))
    assert shuffled.tobytes() == found[:, order].tobytes()


def test_a_band_of_references_is_packed_once(template, rng, monkeypatch):
    comparer = BytesComparer(get_matcher("unit-circle"))
    bands = []
    monkeypatch.setattr(
        comparer_module,
        "PreparedPrints",
        lambda prints: bands.append(list(prints)) or bands[-1],
    )
    monkeypatch.setattr(comparer_module, "similarities", lambda *given: len(given[-1]))
    one, *others = packed(template, rng, 5).values()
    assert [comparer.similarities(one, others) for _ in range(2)] == [3, 3]
    assert comparer.similarities(one, others[1:]) == 2
    assert [len(band) for band in bands] == [3, 2]
