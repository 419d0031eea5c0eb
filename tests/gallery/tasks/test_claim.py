"""A claimed identity is checked against all that is enrolled of it."""

import pytest
from made_prints import entries_of, refused

from fpmatch.gallery.fingers.finger import verify_finger
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.tasks.claim import check_claim
from fpmatch.templates.minutiae import Minutiae, Template


@pytest.fixture
def claims(gallery, template):
    """Return the gallery with impressions of two fingers of ada and of one of bob."""
    m = template.minutiae
    smaller = Template(m.take(range(5)), template.width, template.height)
    other = Template(Minutiae(m.y, m.x, m.angle), template.width, template.height)
    labels = [("ada", "left", "1"), ("ada", "right", "1"), ("ada", "right", "2"), ("bob", "", "")]
    labels = [Label(*label) for label in labels]
    gallery.add(entries_of(smaller, template, smaller, other, labels=labels))
    return gallery


def test_all_impressions_of_the_subject_or_of_the_finger_count(claims, template):
    checked = check_claim(claims, template, "ada")
    assert [entry.id for entry in checked.entries] == [1, 2, 3]
    assert checked.best.label == Label("ada", "right", "1")
    assert 40 < checked.result.verification.score <= checked.result.best_score
    document = checked.as_dict()
    assert (document["subject"], document["impressions"]) == ("ada", 3)
    assert document["best"]["id"] == 2
    assert checked.in_words().startswith("3 impressions of subject ada; the most similar is ")
    of_finger = check_claim(claims, template, "ada", "right")
    references = [claims.template(k) for k in (2, 3)]
    assert of_finger.result.scores.tolist() == verify_finger(template, references).scores.tolist()
    assert not check_claim(claims, template, "bob").result.verification.match


@pytest.mark.parametrize("claim", [("eve",), ("ada", "thumb")])
def test_what_is_not_enrolled_is_refused(claims, template, claim):
    refused(check_claim, claims, template, *claim, code="unknown")
