"""Packed templates: small, the same after the first rounding, and never misread."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import TemplateError
from fpmatch.gallery.compact import VERSION, pack_template, unpack_template
from fpmatch.image.extract import extract
from fpmatch.minutiae import Minutiae, RidgeField, Template


@st.composite
def templates(draw):
    """Draw any template that has a reasonable size, hostile in everything else."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(0, 60))
    width, height = draw(st.integers(1, 2000)), draw(st.integers(1, 2000))
    minutiae = Minutiae(
        x=rng.uniform(-50, width + 50, n),
        y=rng.uniform(-50, height + 50, n),
        angle=rng.uniform(0, 2 * np.pi, n),
        kind=rng.integers(0, 3, n),
        quality=rng.integers(0, 101, n),
    )
    field = None
    if draw(st.booleans()):
        mask = rng.random((draw(st.integers(0, 30)), draw(st.integers(0, 30)))) < draw(
            st.sampled_from([0.0, 0.02, 0.7, 1.0])
        )
        field = RidgeField(draw(st.floats(1, 100)), rng.uniform(0, np.pi, mask.shape), mask)
    dpi = draw(st.floats(100, 4000) | st.sampled_from([500, 569, 499.9]))
    return Template(minutiae, width, height, dpi, field)


@given(templates())
def test_round_trip_is_exact_after_the_first_rounding(template):
    data = pack_template(template)
    again = unpack_template(data)
    assert pack_template(again) == data
    assert unpack_template(pack_template(again)) == again


@given(templates())
def test_round_trip_keeps_what_it_says(template):
    kept = unpack_template(pack_template(template))
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


@pytest.mark.parametrize("dpi", [500, 569])
def test_positions_of_extracted_minutiae_are_exact(fingers, dpi):
    template = extract(fingers[0], dpi=dpi)
    assert len(template.minutiae) > 5
    kept = unpack_template(pack_template(template))
    np.testing.assert_array_equal(kept.minutiae.xy, template.minutiae.xy)


def test_fifty_minutiae_with_their_field_take_at_most_600_bytes(rng):
    """On a print as large as the largest flat ones: 330 mm²."""
    n, mask = 50, np.zeros((30, 40), bool)
    mask[3:26, 7:29] = True
    minutiae = Minutiae(
        x=rng.uniform(0, 640, n), y=rng.uniform(0, 480, n), angle=rng.uniform(0, 6, n)
    )
    field = RidgeField(16.0, rng.uniform(0, np.pi, mask.shape), mask)
    assert len(pack_template(Template(minutiae, 640, 480, 500.0, field))) <= 600


def test_packed_form_stays_what_it_is():
    """A change here is a new version."""
    field = RidgeField(16.0, np.full((2, 3), np.pi / 4), np.array([[0, 1, 1], [0, 0, 1]]))
    minutiae = Minutiae(
        x=[10, 25], y=[7, 5], angle=[np.pi / 2, np.pi], kind=[1, 2], quality=[80, 0]
    )
    assert VERSION == 1
    assert pack_template(Template(minutiae, 300, 400, 500.0, field)).hex() == (
        "666d01" "01" "20a10700" "2c01" "9001" "0200" "0a00" "0500" "04" "02"  # head
        "0f" "80" "4080" "60" "a000"  # x, y, angle, kind, quality
        "00008041" "0200" "0300" "0000" "0100" "0200" "0200" "d0" "4440"  # field
        "e8804dd6"
    )  # fmt: skip


def full_field(rows: int, columns: int, step: float = 1.0) -> RidgeField:
    return RidgeField(step, np.ones((rows, columns)), np.ones((rows, columns)))


@pytest.mark.parametrize(
    "template",
    [
        Template(Minutiae([40_000], [0], [0]), 10, 10),
        Template(Minutiae([0], [-1e30], [0]), 10, 10),
        Template(Minutiae.empty(), 70_000, 10),
        Template(Minutiae.empty(), 10, 10, 500.0, full_field(1, 1, step=1e300)),
        Template(Minutiae.empty(), 10, 10, 500.0, full_field(1, 70_000)),
        Template(Minutiae.empty(), 10, 10, 500.0, full_field(1100, 1000)),
        Template(Minutiae(np.zeros(70_000), np.zeros(70_000), np.zeros(70_000)), 10, 10),
    ],
    ids=["right", "up", "wide", "step", "long", "cells", "many"],
)
def test_what_does_not_fit_is_refused(template):
    with pytest.raises(TemplateError, match="too large"):
        pack_template(template)


def resealed(data: bytes) -> bytes:
    return data + struct.pack("<I", zlib.crc32(data))


def test_every_damage_is_noticed(template):
    data = pack_template(template)
    for k in range(0, len(data), 7):
        changed = bytearray(data)
        changed[k] ^= 0x10
        with pytest.raises(TemplateError):
            unpack_template(bytes(changed))
        with pytest.raises(TemplateError):
            unpack_template(data[:k])
    with pytest.raises(TemplateError):
        unpack_template(data + b"\0")


def test_another_version_is_named(template):
    data = bytearray(pack_template(template)[:-4])
    data[2] = 9
    with pytest.raises(TemplateError, match=r"version 9 \(known: 1\)"):
        unpack_template(resealed(bytes(data)))


def test_whoever_made_the_checksum_gets_an_error_or_a_template(template, rng):
    """Bytes that were never packed raise one kind of error only."""
    packed = pack_template(template)[:-4]
    for _ in range(200):
        body = bytearray(packed)
        for place in rng.integers(3, len(body), rng.integers(1, 4)):
            body[place] = rng.integers(0, 256)
        try:
            again = unpack_template(resealed(bytes(body[: rng.integers(24, len(body) + 1)])))
        except TemplateError:
            continue
        assert isinstance(again, Template)
