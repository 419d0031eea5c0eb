"""Stored bit descriptors: the scores of the prefilter, whatever the prints."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import template_of, templates

from fpmatch.gallery.index.descriptors import NEIGHBOURS, PLACES, StoredDescriptors
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.prints.prepare import prefilter_of, score_descriptors
from fpmatch.templates.minutiae import Minutiae, Template


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
    stored = StoredDescriptors.pack(prints)
    which = np.arange(len(prints))[::-1]
    tables = prefilter_of(prints[-1].bit_descriptors)
    expected = [score_descriptors(tables, kept_of(prints[k])) for k in which]
    assert stored.scores(prints[-1], which).tolist() == expected


def test_a_print_that_is_not_there_is_refused():
    print_ = MATCHER.prepare(template_of(np.ones((4, 1))))
    for which in ([-1], [1], [0, 99]):
        with pytest.raises(IndexError):
            StoredDescriptors.pack([print_]).scores(print_, np.array(which))
