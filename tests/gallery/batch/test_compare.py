"""`fpmatch.gallery.batch.compare`: one probe with many at once, or pair by pair: the same."""

from dataclasses import replace

import numpy as np

from fpmatch.gallery.batch.compare import ComparisonTask, PairComparer, Print
from fpmatch.gallery.batch.plan import AllPairs, PairChunk
from fpmatch.gallery.batch.sources import StoredTemplate, pack
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.registry import get_matcher
from fpmatch.matching.result import Matcher

CURVE = load_calibration("unit-circle")


class OneByOne(Matcher):
    """The default matcher without its way to compare many at once."""

    name = "one by one"

    def prepare(self, template):
        return get_matcher("unit-circle").prepare(template)

    def compare(self, probe, reference):
        return get_matcher("unit-circle").compare(probe, reference)

    def amount(self, prepared):
        return get_matcher("unit-circle").amount(prepared)

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


def test_many_at_once_are_as_one_by_one(template, rng):
    probes, references = prints(template, rng, 3), prints(template, rng, 5)
    (chunk,) = AllPairs(3, 5).chunks()
    task = ComparisonTask(chunk, probes, references)
    found = PairComparer(get_matcher("unit-circle"), calibration=CURVE).similarities(task)
    one_by_one = PairComparer(OneByOne(), calibration=CURVE).similarities(task)
    assert found.tobytes() == one_by_one.tobytes()
    missing = (chunk.probe == 1) | (chunk.reference == 1)
    assert np.isnan(found).tolist() == [missing.tolist()] * 2

    order = rng.permutation(len(chunk))
    listed = PairChunk(chunk.probe[order], chunk.reference[order])
    shuffled = PairComparer(get_matcher("unit-circle"), calibration=CURVE).similarities(
        replace(task, pairs=listed)
    )
    assert shuffled.tobytes() == found[:, order].tobytes()
