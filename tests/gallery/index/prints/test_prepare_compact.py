"""Compact templates prepared many at once are, to the last bit, those that `prepare` prepares."""

import struct
import zlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_prints import flipped
from matching_prints import (
    COMPILED,
    any_points,
    even_field,
    spread_points,
    striped_field,
    template_of,
    templates,
)

from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.gallery.index.print_segment import prepare_prints
from fpmatch.gallery.index.prints import compact_template as module
from fpmatch.gallery.index.prints.compact_template import (
    CompactTemplates,
    compact,
    expand,
    prepare_compact,
)
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.matching.prints.prepare import prepare
from fpmatch.templates.minutiae import Minutiae, Template


def one_by_one(packed):
    return PreparedPrints.pack(prepare(expand(data)) for data in packed)


def assert_same(found, expected):
    for name, array in expected.arrays().items():
        other = getattr(found, name)
        assert (other.dtype, other.shape) == (array.dtype, array.shape), name
        assert other.tobytes() == array.tobytes(), name
        assert other.flags.c_contiguous


def prepared(packed, which=None):
    many = CompactTemplates.of_bytes(packed)
    return prepare_compact(many, np.arange(len(many)) if which is None else np.array(which, int))


def some_templates():
    """Return templates of all kinds: of many and of no minutiae, with and without a field."""
    fields = (striped_field(side=8), even_field(side=9), None, striped_field(side=12, step=18.2))
    holes = np.random.default_rng(3).random((12, 12)) < 0.4
    found = [
        replace(striped_field(side=12), mask=holes),
        replace(striped_field(side=12), mask=np.zeros((12, 12), bool)),
    ]
    made = []
    for k, field in enumerate((*fields, *found)):
        for n in (0, 1, 2, 3, 30, 70 if COMPILED else 31):
            points = spread_points(np.random.default_rng(10 * k + n), n, 8.0)
            quality = (None, np.random.default_rng(n).integers(0, 101, n), np.zeros(n))[n % 3]
            made.append(template_of(points, (500.0, 569.0, 1000.0)[n % 3], quality, field))
    crowd = spread_points(np.random.default_rng(1), 203, 4.0)
    made.append(template_of(crowd, quality=np.arange(203) % 100, field=striped_field(side=20)))
    return made


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 5)), max_size=9))
def test_prints_of_several_segments_are_prepared_in_their_order(which):
    packed = [compact(template) for template in some_templates()[:18]]
    parts = [CompactTemplates.of_bytes(packed[k : k + 6]) for k in (0, 6, 12)]
    segments = [SimpleNamespace(templates=part) for part in parts]
    segment, place = np.array(which, int).reshape(-1, 2).T
    found = prepare_prints(segments, segment, place)
    assert_same(found, one_by_one([packed[6 * a + b] for a, b in which]))


def test_templates_of_all_kinds_are_prepared_alike(monkeypatch):
    packed = [compact(template) for template in some_templates()]
    assert len(packed) == 37
    expected = one_by_one(packed)
    assert_same(prepared(packed), expected)
    order = np.random.default_rng(2).permutation(len(packed))
    assert_same(prepared(packed, order), expected.take(order))
    monkeypatch.setattr(module, "PRINTS_AT_ONCE", 5)
    assert_same(prepared(packed), expected)


@given(st.lists(templates(), max_size=4))
def test_any_templates_are_prepared_alike(given_):
    packed = [compact(template) for template in given_]
    assert_same(prepared(packed), one_by_one(packed))


@pytest.mark.parametrize("which", [[3], [-1], [0, 2**40]])
def test_there_is_no_print_beyond_the_last(which):
    packed = [compact(template_of(any_points(1)))] * 3
    with pytest.raises(IndexError, match="of 3"):
        prepared(packed, which)
    assert len(prepared(packed, [])) == 0


def test_damage_is_stated_as_for_one_template():
    whole = compact(template_of(any_points(3), field=striped_field(side=4)))
    for k in range(0, len(whole), 9):
        for damaged in (flipped(whole, k, 0x10), whole[:k]):
            with pytest.raises(TemplateError) as alone:
                expand(damaged)
            with pytest.raises(TemplateError) as among_others:
                prepared([whole, damaged, whole])
            assert str(among_others.value) == str(alone.value)


def test_whoever_made_the_checksum_gets_the_same_error_or_print(rng):
    points = spread_points(rng, 20, 9.0, 190.0)
    whole = compact(template_of(points, 500.0, rng.integers(0, 101, 20), striped_field(side=12)))
    fine = 0
    for _ in range(300 if COMPILED else 60):
        body = bytearray(whole[:-4])
        for place in rng.integers(0, len(body), rng.integers(1, 3)):
            body[place] = rng.integers(0, 256)
        packed = [whole, bytes(body) + struct.pack("<I", zlib.crc32(body))]
        expected, found = outcome(one_by_one, packed), outcome(prepared, packed)
        if isinstance(expected, str):
            assert found == expected
        else:
            assert_same(found, expected)
            fine += 1
    assert fine


def outcome(work, packed):
    """Return prepared prints, or the message of the error that there is instead."""
    try:
        return work(packed)
    except FpmatchError as error:
        return str(error)


@pytest.mark.parametrize("step", [b"\x01\0\x80\x7f", b"\0\0\xc0\x7f", b"\0\0\x80\xff", bytes(4)])
def test_a_step_that_is_no_length_is_refused(step):
    points = spread_points(np.random.default_rng(1), 3)
    whole = compact(template_of(points, field=striped_field(side=4, step=16.0)))
    body = whole[:-4].replace(struct.pack("<f", 16.0), step)
    data = body + struct.pack("<I", zlib.crc32(body))
    assert data != whole
    with pytest.raises(TemplateError, match="damaged"):
        prepared([whole, data])


def test_numbers_at_their_bounds_are_read():
    far = Template(Minutiae([32_767, -32_767, 0], [-32_767, 0, 5], [0, 1, 2]), 65_535, 1)
    far = replace(far, field=striped_field(side=3, step=10_000.0))
    packed = [compact(far), compact(replace(far, field=striped_field(side=2, step=0.1)))]
    assert_same(prepared(packed), one_by_one(packed))
