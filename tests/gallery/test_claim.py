"""A claimed identity is checked against all that is enrolled of it."""

from __future__ import annotations

import pytest

from fpmatch.errors import GalleryError
from fpmatch.gallery.claim import check_claim
from fpmatch.gallery.entry import Label, NewEntry
from fpmatch.gallery.gallery import open_gallery
from fpmatch.matching.finger import verify_finger


@pytest.fixture
def gallery(tmp_path, template):
    smaller = type(template)(template.minutiae.take(range(5)), template.width, template.height)
    labels = [("ada", "left", "1"), ("ada", "right", "1"), ("ada", "right", "2"), ("bob", "", "")]
    m = template.minutiae
    other = type(template)(type(m)(m.y, m.x, m.angle), template.width, template.height)
    prints = [smaller, template, smaller, other]
    with open_gallery(tmp_path / "claims.db", create=True) as opened:
        opened.add(
            [
                NewEntry(Label(*label), f"{k}.tif", k.to_bytes(32, "big"), one)
                for k, (label, one) in enumerate(zip(labels, prints, strict=True))
            ]
        )
        yield opened


def test_all_impressions_of_the_subject_or_of_the_finger_count(gallery, template):
    checked = check_claim(gallery, template, "ada")
    assert [entry.id for entry in checked.entries] == [1, 2, 3]
    assert checked.best.label == Label("ada", "right", "1")
    assert 40 < checked.result.verification.score <= checked.result.best_score
    document = checked.as_dict()
    assert (document["subject"], document["impressions"]) == ("ada", 3)
    assert document["best"]["id"] == 2
    assert checked.in_words().startswith("3 impressions of subject ada; the most similar is ")
    of_finger = check_claim(gallery, template, "ada", "right")
    references = [gallery.template(k) for k in (2, 3)]
    assert of_finger.result.scores.tolist() == verify_finger(template, references).scores.tolist()
    assert not check_claim(gallery, template, "bob").result.verification.match


@pytest.mark.parametrize(
    ("claim", "words"),
    [(("eve",), "no impression of subject eve"), (("ada", "thumb"), "finger thumb of subject ada")],
)
def test_what_is_not_enrolled_is_refused(gallery, template, claim, words):
    with pytest.raises(GalleryError, match=words):
        check_claim(gallery, template, *claim)
