"""Compact templates: minutiae as a gallery keeps them, ridges nearly so, and never misread."""

import struct
import zlib
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import templates

from fpmatch.errors import TemplateError
from fpmatch.gallery.index.prints.compact_template import compact, expand
from fpmatch.gallery.index.prints.ridge_samples import sample_ridges
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.templates.bounds import check_bounds


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


@given(st.binary(max_size=60))
def test_any_bytes_are_refused_or_a_template_within_bounds(body):
    for data in (body, b"fc" + body, b"fc\x01\x02" + body):
        sealed = data + struct.pack("<I", zlib.crc32(data))
        try:
            check_bounds(expand(sealed))
        except TemplateError:
            continue
