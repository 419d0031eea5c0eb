"""Packed templates: small, the same after the first rounding, and never misread."""

import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from fpmatch.errors import TemplateError
from fpmatch.gallery.store.stored_template import (
    VERSION,
    minutiae_digest,
    pack_template,
    stored_minutiae_digest,
    unpack_template,
)
from fpmatch.image.extract import extract
from fpmatch.templates.bounds import have_same_minutiae
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from tests.matching.matching_prints import templates


def nearly(template):
    """Return templates that differ from one by little, or as a gallery does not keep it."""
    m = template.minutiae
    for x, angle, quality in [(0.2, 0.0, 0), (0.6, 0.0, 0), (0.0, 0.01, 0), (0.0, 0.0, 1)]:
        other = np.minimum(m.quality + np.uint8(quality), 100)
        yield replace(template, minutiae=Minutiae(m.x + x, m.y, m.angle + angle, m.kind, other))
    way = 1 if template.dpi < 1000 else -1
    yield replace(template, dpi=template.dpi + way * 0.0001)
    yield replace(template, dpi=template.dpi + way * 0.002, field=None)
    yield replace(template, height=template.height + 1)
    yield unpack_template(pack_template(template))


@given(templates())
def test_the_digest_is_that_of_what_is_stored_and_equal_where_minutiae_are(template):
    data, digest = pack_template(template), minutiae_digest(template)
    assert stored_minutiae_digest(data) == digest
    assert bool(digest) == (len(template) >= 4)
    assert minutiae_digest(replace(template, field=None)) == digest
    for other in nearly(template):
        same = bool(digest) and minutiae_digest(other) == digest
        assert have_same_minutiae(template, other) == same
    assert have_same_minutiae(template, unpack_template(data)) == bool(digest)


@given(templates())
def test_round_trip_keeps_what_it_says_and_is_exact_after_the_first_rounding(template):
    data = pack_template(template)
    kept = unpack_template(data)
    assert pack_template(kept) == data
    assert unpack_template(pack_template(kept)) == kept
    m, k = template.minutiae, kept.minutiae
    assert (kept.width, kept.height) == (template.width, template.height)
    assert kept.dpi == pytest.approx(template.dpi, abs=5.1e-4)
    np.testing.assert_array_equal(k.kind, m.kind)
    np.testing.assert_array_equal(k.quality, m.quality)
    assert (np.abs(k.xy - m.xy) * 500 / template.dpi <= 0.51).all()
    turn = np.abs(np.angle(np.exp(1j * (k.angle.astype(float) - m.angle))))
    assert (turn <= np.pi / 256 + 1e-5).all()
    assert (kept.field is None) == (template.field is None)
    if kept.field is not None:
        np.testing.assert_array_equal(kept.field.mask, template.field.mask)
        assert kept.field.step == pytest.approx(template.field.step, rel=1e-4)
        difference = 2j * (kept.field.orientation.astype(float) - template.field.orientation)
        turn = np.abs(np.angle(np.exp(difference)))[kept.field.mask] / 2
        assert (turn <= np.pi / 32 + 1e-5).all()
        assert (kept.field.ridges is None) == (template.field.ridges is None)
        np.testing.assert_array_equal(kept.field.ridges, template.field.ridges)


def test_a_resolution_that_nothing_states_stays_marked():
    stated = with_ridges(small_template())
    unstated = replace(stated, dpi_known=False)
    known, unknown = map(pack_template, (stated, unstated))
    assert (known[2], unknown[2]) == (2, 3)
    assert known[3:-4] == unknown[3:-4]
    assert [unpack_template(data).dpi_known for data in (known, unknown)] == [True, False]


@pytest.mark.parametrize("dpi", [500, 569])
def test_positions_of_extracted_minutiae_are_exact(fingers, dpi):
    template = extract(fingers[0], dpi=dpi)
    assert len(template.minutiae) > 5
    kept = unpack_template(pack_template(template))
    np.testing.assert_array_equal(kept.minutiae.xy, template.minutiae.xy)


OLD_HEAD = "666d010120a107002c01900102000a0005000402"
COLUMNS = "0f80408060a000"  # x, y, angle, kind, quality
OF_FIELD = "00008041020003000000010002000200d04440"


def small_template(ridges=None):
    orientation, mask = np.full((2, 3), np.pi / 4), np.array([[0, 1, 1], [0, 0, 1]])
    minutiae = Minutiae(
        x=[10, 25], y=[7, 5], angle=[np.pi / 2, np.pi], kind=[1, 2], quality=[80, 0]
    )
    return Template(minutiae, 300, 400, 500.0, RidgeField(16.0, orientation, mask, ridges))


def with_ridges(template):
    ridges = np.random.default_rng(5).integers(0, 2**64, template.field.mask.shape, np.uint64)
    return replace(template, field=replace(template.field, ridges=ridges))


def resealed(data):
    return bytes(data) + struct.pack("<I", zlib.crc32(data))


def test_packed_form_stays_what_it_is():
    """A change here is a new version."""
    assert VERSION == 2
    ridges = np.array([[9, 1, 0x0123456789ABCDEF], [9, 9, 2**64 - 1]], np.uint64)
    pictures = "00000000000000010123456789abcdefffffffffffffffff"
    for content, given_, more in (("01", None, ""), ("02", ridges, pictures)):
        head = OLD_HEAD.replace("666d0101", f"666d02{content}")
        whole = bytes.fromhex(head + COLUMNS + OF_FIELD + more)
        assert pack_template(small_template(given_)) == resealed(whole)


def test_templates_of_the_first_version_are_read():
    data = bytes.fromhex(OLD_HEAD + COLUMNS + OF_FIELD + "e8804dd6")
    assert unpack_template(data) == unpack_template(pack_template(small_template()))
    assert unpack_template(data).field.ridges is None


FORGED = {
    **{
        f"content {version} {content}": (slice(2, 4), bytes((version, content)), "unknown data")
        for version, content in ((1, 2), (1, 255), (2, 3), (2, 255))
    },
    "version": (slice(2, 3), b"\x09", r"version 9 \(known: up to 3\)"),
    "bits": (slice(18, 19), b"\xff", "too many bits"),
    "area": (slice(8, 12), b"\xff\xff\xff\xff", "65535 x 65535 pixels at 500 dpi is too large"),
    "frame": (slice(41, 43), b"\xff\xff", "leaves its frame"),
    **{f"cut {n}": (slice(-n, None), b"", "damaged") for n in (1, 8, 24, 25, 40)},
    **{f"more {n}": (slice(1000, None), bytes(n), "too many bytes") for n in (1, 8)},
}


@pytest.mark.parametrize("forged", FORGED)
def test_a_stored_print_that_states_something_else_is_damage(forged):
    """The checksum is that of the changed bytes: it is their statements that are checked."""
    data = bytearray(pack_template(with_ridges(small_template()))[:-4])
    place, changed, why = FORGED[forged]
    data[place] = changed
    with pytest.raises(TemplateError, match=why):
        unpack_template(resealed(data))


def full_field(rows, columns, step=1.0):
    field = RidgeField(step, np.ones((rows, columns)), np.ones((rows, columns)))
    return Template(Minutiae.empty(), 10, 10, 500.0, field)


@pytest.mark.parametrize(
    "template",
    [
        Template(Minutiae([40_000], [0], [0]), 10, 10),
        Template(Minutiae([0], [-1e30], [0]), 10, 10),
        Template(Minutiae.empty(), 70_000, 10),
        Template(Minutiae.empty(), 65_535, 65_535),
        full_field(1, 1, step=1e300),
        full_field(1, 70_000),
        full_field(1100, 1000),
        Template(Minutiae(np.zeros(70_000), np.zeros(70_000), np.zeros(70_000)), 10, 10),
    ],
    ids=["right", "up", "wide", "area", "step", "long", "cells", "many"],
)
def test_what_does_not_fit_is_refused(template):
    with pytest.raises(TemplateError, match=r"beyond|more than|outside"):
        pack_template(template)
    assert minutiae_digest(template) == b""
