"""Templates that no finger can have are named; templates of fingers are not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.formats.files import load_record, save_template
from fpmatch.image.extract import extract
from fpmatch.matching.matchers.unit_circle import MATCHER, view_of
from fpmatch.prints.reading import make_given_print
from fpmatch.templates.bounds import MOST_MINUTIAE
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from fpmatch.templates.plausibility import (
    DISORDERED,
    NO_FINGER,
    OFF_RIDGES,
    UNEVEN,
    find_doubts,
    lacks_ridges,
    why_no_finger,
)
from research.templates.making import make_templates

SAMPLES = Path(__file__).parents[2] / "sample_data"
SEEDS = st.integers(0, 2**32 - 1)


def random_template(seed, size, field=None):
    rng = np.random.default_rng(seed)
    columns = rng.uniform((20, 20, 0), (380, 380, 2 * np.pi), (size, 3)).T
    return Template(Minutiae(*columns), 400, 400, field=field)


def ridges(orientation=0.0, part=1.0):
    mask = np.broadcast_to(np.arange(25) < 25 * part, (25, 25))
    return RidgeField(16.0, np.full((25, 25), orientation), mask)


def test_scattered_and_straight_ridges_are_not_those_of_a_finger():
    print_ = extract(SAMPLES / "101_1.tif")
    field = print_.field
    assert lacks_ridges(print_) == ""
    assert lacks_ridges(replace(print_, field=None)) == ""
    rows, columns = np.indices(field.mask.shape)
    scattered = replace(field, mask=field.mask & ((rows // 3 + columns // 3) % 4 == 0))
    assert "scattered" in lacks_ridges(replace(print_, field=scattered))
    straight = replace(field, orientation=np.full_like(field.orientation, 0.1))
    assert "straight" in lacks_ridges(replace(print_, field=straight))
    middle = (abs(rows - rows.mean()) < 4) & (abs(columns - columns.mean()) < 4)
    small = replace(straight, mask=field.mask & middle)
    assert lacks_ridges(replace(print_, field=small)) == ""  # so few may be


@given(SEEDS, st.integers(80, 150))
def test_random_directions_are_those_of_no_finger(seed, size):
    assert why_no_finger(random_template(seed, size)) == f"{NO_FINGER}: {DISORDERED}"


def test_of_very_many_minutiae_the_best_are_compared():
    """All pairs of so many would take fifty gigabytes."""
    many = random_template(3, MOST_MINUTIAE)
    assert why_no_finger(many) == f"{NO_FINGER}: {DISORDERED}"
    m = many.minutiae
    graded = Minutiae(m.x, m.y, m.angle, quality=np.arange(MOST_MINUTIAE) >= MOST_MINUTIAE - 400)
    assert np.array_equal(graded.best(400).x, m.x[-400:])


@given(SEEDS, st.integers(0, 9))
def test_few_minutiae_are_never_named(seed, size):
    assert not why_no_finger(random_template(seed, size, ridges()))


@given(SEEDS, st.integers(20, 100), st.floats(0, 3.1), st.booleans())
def test_minutiae_along_their_ridges_are_not_named_and_across_them_are(seed, size, turn, back):
    given_ = random_template(seed, size)
    angle = np.full(size, turn + np.pi * back)
    m = given_.minutiae
    along = replace(given_, minutiae=Minutiae(m.x, m.y, angle), field=ridges(turn))
    assert not why_no_finger(along)
    assert not view_of(MATCHER.prepare(along)).lies_off_ridges()
    across = replace(along, minutiae=Minutiae(m.x, m.y, angle + np.pi / 2))
    assert why_no_finger(across) == f"{NO_FINGER}: {OFF_RIDGES}"
    assert view_of(MATCHER.prepare(across)).lies_off_ridges()
    assert OFF_RIDGES in why_no_finger(replace(along, field=ridges(turn, part=0.3)))


@given(SEEDS, st.integers(4, 30), st.integers(1, 20))
def test_few_minutiae_with_nearly_all_of_the_quality_are_named(seed, size, low):
    """Before, the others counted for nothing where they had no partner."""
    made = random_template(seed, size)
    m, rest = made.minutiae, np.arange(size) >= max(size // 4, 1)
    quality = np.where(rest, low, 100)
    uneven = replace(made, minutiae=Minutiae(m.x, m.y, m.angle, quality=quality))
    assert why_no_finger(uneven) == f"{NO_FINGER}: {UNEVEN}"
    assert len(set(MATCHER.prepare(uneven).quality.tolist())) == 1
    for even in (np.where(rest, 60, 100), np.full(size, low)):
        graded = replace(made, minutiae=Minutiae(m.x, m.y, m.angle, quality=even))
        assert not why_no_finger(graded)
        assert MATCHER.prepare(graded).quality.tolist() == (even / 100).tolist()


def test_prints_of_fingers_are_not_named():
    made = [extract(path) for path in sorted(SAMPLES.glob("*_1.tif"))]
    made += make_templates(seed=31, fingers=range(1, 201))
    forms = [*made, *(replace(one, field=None) for one in made)]
    assert not any(map(why_no_finger, forms))


@pytest.mark.parametrize("suffix", [".json", ".iso"])
def test_such_a_template_has_a_note(tmp_path, suffix):
    path = tmp_path / f"made{suffix}"
    save_template(path, random_template(1, 80))
    made = make_given_print(load_record(path), path.name)
    assert f"{NO_FINGER}: {DISORDERED}" in made.notes
    assert set(find_doubts(made.template)) <= set(made.notes)


def test_dots_an_inch_written_as_pixels_a_centimetre_are_named(fingers):
    meant = replace(extract(fingers[0], 500), field=None)
    assert find_doubts(meant) == ()
    for dpi, per_cm in ((1270.0, 500), (1290.0, 508), (1445.0, 569)):
        (doubt,) = find_doubts(replace(meant, dpi=dpi))
        assert doubt == (
            f"probably {per_cm} dpi, written as {per_cm} pixels a cm: its minutiae are too close "
            f"for {dpi:g}"
        )
    for dpi in (569.0, 1000.0, 1200.0, 1270.0):  # of a scanner
        factor = dpi / 500
        minutiae = replace(meant.minutiae, x=meant.minutiae.x * factor, y=meant.minutiae.y * factor)
        sides = round(meant.width * factor), round(meant.height * factor)
        assert find_doubts(Template(minutiae, *sides, dpi)) == ()
