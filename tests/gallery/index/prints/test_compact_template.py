"""Compact templates: minutiae as a gallery keeps them, ridges nearly so, and never misread."""

import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_prints import flipped
from matching_prints import spread_points, striped_field, template_of, templates

from fpmatch.errors import TemplateError
from fpmatch.gallery.index.prints.compact_template import compact, expand
from fpmatch.gallery.index.prints.ridge_samples import sample_ridges
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.templates.bounds import check_bounds
from fpmatch.templates.minutiae import Minutiae, Template

every_codec = pytest.mark.parametrize(
    ("pack", "unpack", "ridged"),
    [
        (compact, expand, True),
        *((pack_template, unpack_template, ridged) for ridged in (True, False)),
    ],
    ids=["compact", "stored", "stored without ridges"],
)


def a_print(seed=1, n=30, side=12, *, ridged=True):
    points = spread_points(np.random.default_rng(seed), n, 9.0, 190.0)
    quality = np.random.default_rng(seed).integers(0, 101, n)
    field = striped_field(side=side)
    return template_of(points, 500.0, quality, field if ridged else replace(field, ridges=None))


@given(templates())
def test_all_but_ridges_is_as_a_gallery_keeps_it(template):
    found, kept = expand(compact(template)), unpack_template(pack_template(template))
    assert found.minutiae == kept.minutiae
    assert (found.width, found.height, found.dpi) == (kept.width, kept.height, kept.dpi)
    assert (found.field is None) == (kept.field is None)
    if kept.field is None:
        return
    assert replace(found.field, ridges=None) == replace(kept.field, ridges=None)
    assert (found.field.ridges is None) == (kept.field.ridges is None)
    if kept.field.ridges is not None:
        mask = kept.field.mask
        samples = (sample_ridges(field.ridges[mask]) for field in (found.field, kept.field))
        np.testing.assert_array_equal(*samples)


@given(templates())
def test_an_expanded_template_gives_the_same_bytes(template):
    data = compact(template)
    assert compact(expand(data)) == data
    assert expand(compact(expand(data))) == expand(data)
    assert compact(unpack_template(pack_template(template))) == data


def test_a_cell_takes_a_byte_for_its_ridges():
    template = a_print()
    bare = replace(template, field=replace(template.field, ridges=None))
    cells = np.count_nonzero(template.field.mask)
    assert cells > 100
    assert len(compact(template)) == len(compact(bare)) + cells
    assert len(pack_template(template)) == len(compact(template)) + 7 * cells


def test_a_print_of_a_finger_takes_less_than_750_bytes():
    """With as many minutiae and cells as those of FVC have in the mean."""
    template = a_print(n=34, side=17)
    assert np.count_nonzero(template.field.mask) >= 280
    assert len(compact(template)) <= 750


def test_what_does_not_fit_is_refused():
    with pytest.raises(TemplateError, match="beyond"):
        compact(Template(Minutiae([40_000], [0], [0]), 10, 10))


def test_a_small_print_is_as_a_gallery_keeps_it():
    """Of 117 cells at 500 dpi; a comparison looks at more bits of the ridges of such a print."""
    for side, dpi, small in ((10, 500.0, True), (11, 500.0, False), (11, 569.0, True)):
        template = replace(a_print(side=side), dpi=dpi)
        kept = unpack_template(pack_template(template))
        assert (compact(template) == pack_template(template)) == small
        assert (expand(compact(template)) == kept) == small


def test_another_layout_is_refused():
    template = a_print()
    with pytest.raises(TemplateError, match="not a packed template"):
        unpack_template(compact(template))
    later = bytearray(compact(template))
    later[2] = 2
    with pytest.raises(TemplateError, match="version 2"):
        expand(bytes(later))


@every_codec
def test_every_damage_is_noticed(pack, unpack, ridged):
    data = pack(a_print(ridged=ridged))
    for k in range(0, len(data), 5):
        for damaged in (flipped(data, k, 0x10), data[:k], data[k:], data + data[:k], data + b"\0"):
            if damaged != data:
                with pytest.raises(TemplateError):
                    unpack(damaged)


@given(st.binary(max_size=60))
def test_any_bytes_are_refused_or_a_template_within_bounds(body):
    for data in (body, b"fc" + body, b"fc\x01\x02" + body):
        sealed = data + struct.pack("<I", zlib.crc32(data))
        try:
            check_bounds(expand(sealed))
        except TemplateError:
            continue


@every_codec
def test_whoever_made_the_checksum_gets_an_error_or_a_template(pack, unpack, ridged, rng):
    packed = pack(a_print(ridged=ridged))[:-4]
    read = 0
    for _ in range(200):
        body = bytearray(packed)
        for place in rng.integers(3, len(body), rng.integers(1, 4)):
            body[place] = rng.integers(0, 256)
        whole = bytes(body[: rng.integers(24, 2 * len(body))])
        try:
            template = unpack(whole + struct.pack("<I", zlib.crc32(whole)))
        except TemplateError:
            continue
        check_bounds(template)
        assert pack(unpack(pack(template))) == pack(template)
        read += 1
    assert read
