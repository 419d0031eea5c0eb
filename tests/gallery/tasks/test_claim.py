"""A claimed identity is checked against all that is enrolled of it."""

from pathlib import Path

import cv2
import pytest
from made_prints import entries_of, refused

from fpmatch.gallery.fingers.finger import verify_finger
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.tasks.claim import check_claim
from fpmatch.image.extract import extract
from fpmatch.image.io.read import GreyImage, read_image
from fpmatch.prints.reading import make_given_print
from fpmatch.templates.minutiae import Minutiae, Template

SAMPLES = Path(__file__).resolve().parents[3] / "sample_data"


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
    assert 40 < checked.result.verification.score <= checked.result.best_score
    document = checked.as_dict()
    assert (document["subject"], document["impressions"]) == ("ada", 3)
    assert document["best"]["id"] == 2
    assert checked.in_words().startswith("3 impressions of subject ada; the most similar is ")
    of_finger = check_claim(claims, template, "ada", "right")
    references = [claims.template(k) for k in (2, 3)]
    assert of_finger.result.scores.tolist() == verify_finger(template, references).scores.tolist()
    assert not check_claim(claims, template, "bob").result.verification.match
    for claim in (("eve",), ("ada", "thumb")):
        refused(check_claim, claims, template, *claim, code="unknown")


def test_a_probe_without_a_resolution_is_tried_at_others_for_a_lower_score(gallery):
    files = [SAMPLES / f"101_{number}.tif" for number in (2, 3)]
    labels = [Label("101", "", "2"), Label("101", "", "3")]
    gallery.add(entries_of(*(extract(file, 500) for file in files), labels=labels))

    def checked(finger, dpi=None):
        pixels = read_image(SAMPLES / f"{finger}_1.tif").pixels
        image = GreyImage(
            cv2.resize(pixels, None, fx=0.726, fy=0.726, interpolation=cv2.INTER_AREA)
        )
        return check_claim(gallery, make_given_print(image, "probe", dpi=dpi), "101")

    found, stated = checked(101), checked(101, 363)
    assert found.result.verification.match
    assert (found.probe.template.dpi, found.probe.template.dpi_known) == (363, False)
    assert found.result.verification.dpi_assumed == ("probe",)
    lower = stated.result.verification.score - found.result.verification.score
    assert lower == pytest.approx(10)
    assert stated.result.best_score - found.result.best_score == pytest.approx(10)
    assert not checked(101, 500).result.verification.match
    assert not checked(102).result.verification.match
