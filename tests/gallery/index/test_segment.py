"""Segments: the mate has most votes, scores are those of the prefilter, damage is refused."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import any_points, jittered, moved, spread_points, template_of, templates
from test_terms import whorl

from fpmatch.errors import MatcherError
from fpmatch.gallery.index._segment_kernel import compare_embeddings, count_votes
from fpmatch.gallery.index.embedding import LENGTH
from fpmatch.gallery.index.segment import (
    COLUMNS,
    NEIGHBOURS,
    PLACES,
    WORDS_OF_A_PRINT,
    Segment,
)
from fpmatch.gallery.index.terms import probe_terms
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.prints.prepare import prefilter_of, score_descriptors
from fpmatch.templates.minutiae import Minutiae, Template


def segment_of(templates, first=0):
    numbers = range(first, first + len(templates))
    return Segment.build(numbers, numbers, [*map(MATCHER.prepare, templates)])


def gallery(seed, count=40, n=30):
    rng = np.random.default_rng(seed)
    return [template_of(spread_points(rng, n)) for _ in range(count)]


@pytest.mark.parametrize("fields", [(0, 0), (0, 1), (1, 0)])
def test_a_mate_is_found_whether_or_not_its_orientation_is_known(fields):
    rng = np.random.default_rng(8)
    finger = spread_points(rng, 30)
    of_probe, of_mate = (whorl((150.0, 150.0)) if known else None for known in fields)
    mate = template_of(jittered(rng, finger, 1.5, 0.05), field=of_mate)
    segment = segment_of([*gallery(5), mate])
    votes, _ = segment.votes(probe_terms(MATCHER.prepare(template_of(finger, field=of_probe))))
    assert votes.argmax() == len(segment) - 1


def test_ridges_that_bend_alike_add_votes():
    rng = np.random.default_rng(9)
    finger = spread_points(rng, 20)
    same, other = (whorl((x, 150.0)) for x in (150.0, 1500.0))
    prints = [template_of(jittered(rng, finger, 1.5, 0.05), field=f) for f in (same, other)]
    probe = probe_terms(MATCHER.prepare(template_of(finger, field=same)))
    votes, _ = segment_of(prints).votes(probe)
    assert votes[0] > 1.3 * votes[1]


def votes_by_hand(segment, probe, factor):
    """Count the votes of each print in cells of shifts and rotation; return the best four's."""
    counted = np.zeros((len(segment), 4, 16, 4))
    for term, weight, reading in zip(probe.term, probe.weight, probe.reading, strict=True):
        for posting in segment.posting[slice(*segment.term_start[term : term + 2])].tolist():
            own = int(probe.shift[reading, posting >> 10 & 63])
            x, y = ((posting >> 5) - (own >> 5)) >> 3 & 3, (posting - own) >> 3 & 3
            counted[posting >> 16, x, own >> 10, y] += weight
    cells = np.minimum(counted, 63)
    for axis in (1, 2):  # adjacent ones along x and of rotation, which repeat
        cells += np.roll(cells, -1, axis)
    return cells.reshape(len(segment), -1).max(1).astype(int) * factor // 4


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.1, 0.5, 50.0]))
def test_votes_are_those_counted_by_hand(seed, budget):
    rng = np.random.default_rng(seed)
    templates = [template_of(any_points(int(k), 15)) for k in rng.integers(0, 2**32, 6)]
    segment = segment_of(templates)
    probe = probe_terms(MATCHER.prepare(templates[0]), budget)
    looked_up = probe.term, probe.weight, probe.reading, probe.shift
    table = np.empty(len(segment) * WORDS_OF_A_PRINT, np.uint32)
    made = np.zeros(len(segment), np.uint16)
    factor = rng.integers(0, 1025, len(segment)).astype(np.uint16)
    count_votes(segment.term_start, segment.posting, *looked_up, factor, table, made)
    assert made.tolist() == votes_by_hand(segment, probe, factor).tolist()


@given(st.integers(0, 2**32 - 1))
def test_the_most_similar_of_turned_embeddings_counts(seed):
    rng = np.random.default_rng(seed)
    embedding = rng.integers(-127, 128, (9, LENGTH), np.int8)
    embedding[-1] = 127
    probe, made = embedding[:4].astype(np.int16), np.empty(9, np.uint16)
    compare_embeddings(embedding, probe, made)
    product = embedding.astype(int) @ probe.T.astype(int) // 32 - [0, 300, 300, 300]
    assert made.tolist() == np.maximum(product.max(axis=1), 0).tolist()
    assert made[0] > 6000


def at_whole_pixels(template):
    """Return a prepared print whose positions are whole pixels at 500 dpi, as in galleries."""
    m = template.minutiae
    places = (np.rint(np.clip(values, -3e4, 3e4)) for values in (m.x, m.y))
    whole = Minutiae(*places, m.angle, m.kind, m.quality)
    return MATCHER.prepare(Template(whole, template.width, template.height, 500.0, template.field))


def kept_of(print_):
    """Return the bit descriptors of a print without the words that an index does not keep."""
    b = print_.bit_descriptors
    words, bins = np.full_like(b.neighbour_bits, 0x8800), np.full_like(b.orientation_bins, 31)
    words[:, :NEIGHBOURS] = b.neighbour_bits[:, :NEIGHBOURS]
    bins[:, PLACES] = b.orientation_bins[:, PLACES]
    return replace(b, neighbour_bits=words, orientation_bins=bins)


@given(templates(), st.lists(templates(), max_size=3))
def test_scores_are_those_of_the_prefilter(probe, references):
    prints = [at_whole_pixels(template) for template in [*references, probe]]
    numbers, which = range(len(prints)), np.arange(len(prints))[::-1]
    tables = prefilter_of(prints[-1].bit_descriptors)
    expected = [score_descriptors(tables, kept_of(prints[k])) for k in which]
    assert Segment.build(numbers, numbers, prints).scores(prints[-1], which).tolist() == expected


@pytest.mark.parametrize("turn_deg", [0, 31, 90, 180, 275])
def test_the_mate_has_most_votes_however_it_is_turned(turn_deg):
    rng = np.random.default_rng(turn_deg)
    finger = spread_points(rng, 30)
    turned = moved(finger[:, 4:], np.radians(turn_deg), 20 - 9j)
    mate = template_of(jittered(rng, turned, 2.0, 0.05))
    others = gallery(5)
    segment = segment_of([*others, mate])
    votes, _ = segment.votes(probe_terms(MATCHER.prepare(template_of(finger))))
    assert votes.argmax() == len(others)
    assert votes[-1] > 1.5 * votes[:-1].max()


@pytest.mark.parametrize("n", [0, 1, 2, 3, 200, 255])
def test_prints_of_any_size(n):
    rng = np.random.default_rng(n)
    templates = [template_of(spread_points(rng, k, 9.0, 400.0), size=500) for k in (n, 12, 0)]
    segment = segment_of(templates)
    for template in templates:
        assert segment.votes(probe_terms(MATCHER.prepare(template))).shape == (2, 3)
    again = Segment.of_arrays(segment.arrays())
    assert again.arrays().keys() == segment.arrays().keys() == COLUMNS.keys()
    assert len(segment_of([])) == 0


def changed(arrays, name, at, value):
    array = arrays[name].copy()
    array[at] = value
    return {**arrays, name: array}


def test_damaged_arrays_are_refused():
    whole = segment_of(gallery(8, 4, 12)).arrays()
    last = len(whole["posting"])
    some = int(np.flatnonzero(np.diff(whole["term_start"]))[0]) + 1
    for name, at, value in (
        ("term_start", 0, 1),
        ("term_start", -1, last - 1),
        ("term_start", -1, last + 1),
        ("term_start", some, 2**32 - 1),
        ("posting", last - 1, 4 << 16),
        ("described", 1, 257),
        ("described", 2, 1),
        ("orientation_bins", 7, 255),
    ):
        with pytest.raises(MatcherError, match="damaged"):
            Segment.of_arrays(changed(whole, name, at, value))
    for prints in (0, 4097):
        with pytest.raises(MatcherError, match="damaged"):
            Segment.of_arrays({**whole, "number": np.zeros(prints, np.int64)})


MADE = [MATCHER.prepare(template_of(any_points(seed))) for seed in range(12)]
NUMBERS = np.cumsum(np.arange(1, 13))


def built(places):
    which = np.array(places, np.int64)
    return Segment.build(NUMBERS[which], -NUMBERS[which], [MADE[k] for k in which])


@given(st.lists(st.integers(0, 12), max_size=4), st.sets(st.integers(0, 11)))
def test_prints_of_segments_are_joined_as_if_they_were_built_together(ends, left_out):
    kept = ~np.isin(np.arange(12), [*left_out])
    bounds = [*pairwise([0, *sorted(ends), 12])]
    joined = Segment.joined([(built(range(*pair)), kept[slice(*pair)]) for pair in bounds])
    expected = built(np.flatnonzero(kept)).arrays()
    for name, array in joined.arrays().items():
        assert (array.dtype, array.tolist()) == (expected[name].dtype, expected[name].tolist())
