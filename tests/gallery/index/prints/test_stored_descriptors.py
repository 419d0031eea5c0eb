"""Packed bit descriptors: the prefilter's scores to the last bit, in few bytes, never misread."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    even_field,
    spread_points,
    striped_field,
    template_of,
    templates,
)

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints._descriptor_kernel import DescriptorReader
from fpmatch.gallery.index.prints.descriptor_scores import prefilter_scores
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.gallery.index.prints.stored_descriptors import StoredDescriptors
from fpmatch.matching.prints.bit_descriptors import prefilter_of
from fpmatch.matching.prints.prepare import prepare

NO_WORD = 0x8800


def whole_pixels(n, seed=0, dpi=500.0, field=None, size=300.0):
    """Return a prepared print of n minutiae at whole pixels, as galleries contain them."""
    points = spread_points(np.random.default_rng(seed), n, 9.0, size)
    points[:2] = np.rint(points[:2])
    return prepare(template_of(points, dpi, field=field, size=int(size)))


def some_prints(sizes=(12, 0, 3, 25, 2, 70)):
    fields = None, even_field(side=9), striped_field(side=8)
    return [whole_pixels(n, k, (500.0, 1000.0)[k % 2], fields[k % 3]) for k, n in enumerate(sizes)]


def assert_same_scores(packed, prints, probes):
    many = PreparedPrints.pack(prints)
    for probe in probes:
        expected = prefilter_scores(probe, many)
        assert packed.scores(probe).tolist() == expected.tolist()
        assert packed.scores(prefilter_of(probe.bit_descriptors)).tolist() == expected.tolist()


def test_scores_of_whole_pixels_are_those_of_the_prefilter():
    prints = some_prints()
    packed = StoredDescriptors.pack(prints)
    assert_same_scores(packed, prints, prints)
    assert packed.size.tolist() == [len(one) for one in prints]
    assert packed.scores(prints[3])[3] > 0


@given(templates(), st.lists(templates(), max_size=3))
def test_any_print_comes_back_with_rounded_positions(probe, references):
    prints = [prepare(template) for template in [*references, probe]]
    packed = StoredDescriptors.pack(prints)
    for k, print_ in enumerate(prints):
        expected, found = print_.bit_descriptors, packed[k]
        counts = (expected.neighbour_bits & NO_WORD) != NO_WORD
        kept = counts.any(axis=1)
        step = 2.0 ** packed.step[k]
        assert step == 1 or np.ptp(expected.xy[kept], axis=0).max() >= 511 * step
        beyond = np.abs(expected.xy).max(initial=0) * 1e-6
        assert (np.abs(found.xy - expected.xy[kept]) <= step / 2 + beyond).all()
        assert found.direction_bin.tolist() == expected.direction_bin[kept].tolist()
        assert found.orientation_bins.tolist() == expected.orientation_bins[kept].tolist()
        assert found.has_flow == expected.has_flow
        for row, words, used in zip(
            found.neighbour_bits, expected.neighbour_bits[kept], counts[kept], strict=True
        ):
            assert sorted(row[: used.sum()]) == sorted(words[used])
            assert (row[used.sum() :] == NO_WORD).all()
    assert len(packed.scores(prints[-1])) == len(prints)


@pytest.mark.parametrize("damaged", [False, True])
def test_compiled_and_interpreted_readers_agree(interpreted, damaged, rng):
    packed = StoredDescriptors.pack(some_prints())
    content = packed.content.copy()
    if damaged:
        places = rng.integers(0, len(content), 30)
        content[places] = rng.integers(0, 2**32, len(places))
    packed = StoredDescriptors.of_arrays(packed.arrays() | {"content": content})
    one, other = (
        DescriptorReader(packed),
        interpreted("_descriptor_kernel").DescriptorReader(packed),
    )
    sizes = [one.unpack(k) for k in range(len(packed))]
    assert damaged == (min(sizes) < 0)
    for k, n in enumerate(sizes):
        assert one.unpack(k) == other.unpack(k) == n
        for name in ("xy", "direction_bin", "neighbour_bits", "orientation_bins"):
            made, expected = (np.asarray(getattr(reader, name)) for reader in (one, other))
            assert made[: max(n, 0)].tolist() == expected[: max(n, 0)].tolist()


def test_prints_are_scored_in_any_order_and_again():
    prints = some_prints()
    packed = StoredDescriptors.pack(prints)
    which = np.array([5, 0, 3, 3, 1], np.uint16)
    whole = packed.scores(prints[3])
    assert packed.scores(prints[3], which).tolist() == whole[which].tolist()
    assert packed.scores(prints[3], np.array([], np.int64)).tolist() == []
    for outside in ([-1], [6], [0, 2**62]):
        with pytest.raises(IndexError, match="of 6"):
            packed.scores(prints[3], np.array(outside))


@pytest.mark.parametrize("reach", [900.0, 1500.0, 60_000.0])
def test_wide_prints_have_wider_steps(reach):
    points = np.zeros((4, 4))
    points[0], points[1], points[2] = [0, 20, reach - 20, reach], [0, -20, 20 - reach, -reach], 1
    packed = StoredDescriptors.pack([prepare(template_of(points, size=60_000))])
    assert 2.0 ** packed.step[0] * 1023.5 >= reach
    assert packed.step[0] == 0 or 2.0 ** packed.step[0] * 1023.5 < 2 * reach


def test_another_length_is_refused():
    packed = StoredDescriptors.pack(some_prints((12, 9, 4)))
    for name in ("content_start", "content"):
        with pytest.raises(MatcherError):
            StoredDescriptors.of_arrays(packed.arrays() | {name: getattr(packed, name)[:-1]})


def test_any_content_gives_scores_or_is_refused(rng):
    """Whatever the bytes are, no kernel leaves an array."""
    prints = some_prints((12, 25, 40))
    packed = StoredDescriptors.pack(prints)
    refused = 0
    for _ in range(60 if COMPILED else 6):
        content = packed.content.copy()
        places = rng.integers(0, len(content), rng.integers(1, len(content)))
        content[places] = rng.integers(0, 2**32, len(places))
        damaged = StoredDescriptors.of_arrays(packed.arrays() | {"content": content})
        try:
            assert (damaged.scores(prints[1]) >= 0).all()
        except MatcherError:
            refused += 1
    assert refused
