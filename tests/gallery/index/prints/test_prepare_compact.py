"""Compact templates prepared many at once are, to the last bit, those that `prepare` prepares."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import (
    templates,
)

from fpmatch.gallery.index.prints.compact_template import (
    CompactTemplates,
    compact,
    expand,
    prepare_compact,
)
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.matching.matchers.unit_circle import MATCHER


def one_by_one(packed):
    return PreparedPrints.pack(MATCHER.prepare(expand(data)) for data in packed)


def assert_same(found, expected):
    for name, array in expected.arrays().items():
        other = getattr(found, name)
        assert (other.dtype, other.shape) == (array.dtype, array.shape), name
        assert other.tobytes() == array.tobytes(), name
        assert other.flags.c_contiguous


def prepared(packed, which=None):
    many = CompactTemplates.of_bytes(packed)
    return prepare_compact(many, np.arange(len(many)) if which is None else np.array(which, int))


@given(st.lists(templates(), max_size=4))
def test_any_templates_are_prepared_alike(given_):
    packed = [compact(template) for template in given_]
    assert_same(prepared(packed), one_by_one(packed))
