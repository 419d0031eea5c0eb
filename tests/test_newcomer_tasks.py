"""What the page of first tasks says of changes to the matcher happens."""

from dataclasses import replace
from pathlib import Path

import pytest

from fpmatch import extract, verify
from fpmatch.matching.matchers.reference import ReferenceMatcher
from fpmatch.matching.prints import prepare
from fpmatch.matching.reference import match
from fpmatch.matching.reference import prepare as prepared

SAMPLES = Path(__file__).resolve().parents[1] / "sample_data"


@pytest.fixture(scope="module")
def templates():
    """Return two templates of one finger."""
    return [extract(SAMPLES / f"101_{number}.tif") for number in (1, 3)]


def test_eq_3_enters_by_the_places_on_the_circle_and_has_a_weight(templates):
    prints = [*map(prepared, templates)]
    _, before = match(*prints)
    _, after = match(*prints, ReferenceMatcher(place_tolerance=0.15).parameters)
    assert after.places < before.places
    assert after.total != before.total


def test_ridges_are_ignored_where_the_area_or_the_template_has_none(templates, monkeypatch):
    assert verify(*templates).compared.ridge_agreement > 0
    bare = [replace(one, field=replace(one.field, ridges=None)) for one in templates]
    area_of_field = prepare.area_of_field
    monkeypatch.setattr(
        prepare, "area_of_field", lambda *given: replace(area_of_field(*given), ridges=None)
    )
    ignored, without = verify(*templates), verify(*bare)
    assert ignored.compared.ridge_agreement is without.compared.ridge_agreement is None
    assert ignored.score == without.score
