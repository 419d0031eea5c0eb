"""`fpmatch.gallery.batch.compare`: one probe with many at once, or pair by pair: the same."""

from dataclasses import replace

import numpy as np

from fpmatch.gallery.batch import compare
from fpmatch.gallery.batch.compare import ComparisonTask, PairComparer, Print
from fpmatch.gallery.batch.plan import AllPairs, PairChunk
from fpmatch.gallery.batch.sources import StoredTemplate, pack
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


def prints(template, rng, count):
    """Return disturbed prints; the one of number 1 has no template."""
    made = {}
    for number in range(count):
        m = template.minutiae.take(np.sort(rng.permutation(len(template.minutiae))[:20]))
        data = None if number == 1 else pack(replace(template, minutiae=m))
        made[number] = Print(str(number), "", None, StoredTemplate(data))
    return made


def test_many_at_once_are_as_one_by_one(template, rng, monkeypatch):
    counts, together = [], compare.similarities
    monkeypatch.setattr(
        compare,
        "similarities",
        lambda *given: counts.append(given[4] - given[3]) or together(*given),
    )
    probes, references = prints(template, rng, 3), prints(template, rng, 5)
    (chunk,) = AllPairs(3, 5).chunks()
    task = ComparisonTask(chunk, probes, references)
    found = PairComparer(get_matcher("unit-circle"), capacity=2).similarities(task)
    assert counts == [4, 4]
    assert found.tobytes() == PairComparer(OneByOne()).similarities(task).tobytes()
    missing = (chunk.probe == 1) | (chunk.reference == 1)
    assert np.isnan(found).tolist() == [missing.tolist()] * 2

    order = rng.permutation(len(chunk))
    listed = PairChunk(chunk.probe[order], chunk.reference[order])
    shuffled = PairComparer(get_matcher("unit-circle")).similarities(replace(task, pairs=listed))
    assert shuffled.tobytes() == found[:, order].tobytes()


def test_each_print_with_all_after_it_is_packed_once(template, rng, monkeypatch):
    packed, prepared_prints = [], compare.PreparedPrints
    monkeypatch.setattr(
        compare, "PreparedPrints", lambda some: packed.append(1) or prepared_prints(some)
    )
    ours = prints(template, rng, 9)
    i, j = (side.astype(np.int32) for side in np.triu_indices(9, k=1))
    comparer = PairComparer(get_matcher("unit-circle"))
    found = [
        comparer.similarities(ComparisonTask(PairChunk(i[k:], j[k:]), ours, ours)) for k in (0, 8)
    ]
    assert len(packed) == 1
    task = ComparisonTask(PairChunk(i, j), ours, ours)
    expected = PairComparer(OneByOne()).similarities(task)
    assert found[0].tobytes() == expected.tobytes()
    assert found[1].tobytes() == expected[:, 8:].tobytes()
