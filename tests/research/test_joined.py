from dataclasses import replace

import numpy as np
import pytest

from fpmatch.gallery.listing.two_prints import why_two_prints
from fpmatch.lab.synthesis.templates import make_templates
from research.attacks.joined import ALONE, FORMS, Source, measure_joined
from research.attacks.joining import ALTERNATING, CUT, KINDS, ON_TOP, SIDE_BY_SIDE, TOUCHING, Joint
from research.tables.joined import format_joined, joined_kept

LEAST = {SIDE_BY_SIDE: 1.0, TOUCHING: 0.8, ALTERNATING: 1.0, ON_TOP: 0.8, CUT: 0.6}
FINGERS = 60


@pytest.fixture(scope="module")
def prints():
    return list(make_templates(77, range(FINGERS)))


def test_hardly_a_print_has_a_sign_with_ridges_or_without(prints):
    alone = [replace(one, field=None) for one in prints]
    assert sum(bool(why_two_prints(one)) for one in prints + alone) <= 1


@pytest.mark.parametrize("kind", KINDS)
def test_joined_prints_are_noticed(prints, kind):
    pairs = list(zip(prints[::2], prints[1::2], strict=True))
    turns = np.random.default_rng(0).uniform(0, np.pi, len(pairs))
    joined = [
        Joint.of(a, b, kind, turn).templates(a, b)
        for (a, b), turn in zip(pairs, turns, strict=True)
    ]
    assert np.mean([bool(why_two_prints(one)) for one in joined]) >= LEAST[kind]


def test_each_way_keeps_the_minutiae_that_it_states(prints):
    a, b = prints[:2]
    count = {kind: len(Joint.of(a, b, kind, 1.0).templates(a, b).minutiae) for kind in KINDS}
    assert count[SIDE_BY_SIDE] == count[TOUCHING] == len(a.minutiae) + len(b.minutiae)
    assert count[ON_TOP] == count[ALTERNATING] > count[CUT]
    sheet = Joint.of(a, b, SIDE_BY_SIDE).images(*(np.full((374, 388), g, np.uint8) for g in (3, 9)))
    assert (sheet[:374, 0] == 3).all()
    assert sheet.shape[1] >= 2 * 388
    assert set(np.unique(sheet)) == {3, 9, 255}


def test_the_table_has_all_ways_and_counts_all_prints(prints):
    impressions = [(one, two) * 2 for one, two in zip(prints[:20], prints[20:40], strict=True)]
    source = Source("made", impressions)
    measured = measure_joined([source], pairs=4, images=0)
    rows = {(row["kind"], row["form"]): row for row in measured["joined"]}
    assert set(rows) == {(kind, form) for kind in (ALONE, *KINDS) for form in FORMS}
    assert all(rows[ALONE, form]["any"] == 1 for form in FORMS)
    assert all(row["match"] >= row["unnoticed"] for row in rows.values())
    assert all(row["any"] >= row["match"] for row in measured["joined"])
    assert any(row["any"] > row["match"] for row in measured["joined"])
    assert measured["ordinary"][0]["prints"] == 80
    table = format_joined(joined_kept(measured))
    assert all(kind in table for kind in KINDS)
    assert "| all | 80 | 0 | 0 |" in table
    alone = measure_joined([Source("two", [(one, one) for one in prints[:20]])], pairs=1, images=0)
    assert {row["any"] for row in alone["joined"]} == {None}
