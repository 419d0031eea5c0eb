import itertools
from dataclasses import replace

import numpy as np
from PIL import Image

from fpmatch.evaluation.report.hardest import (
    explain_false_match,
    explain_false_non_match,
    hardest_pairs,
)
from fpmatch.evaluation.run import evaluate
from fpmatch.matching.result import Comparison, Verification
from fpmatch.minutiae import Minutiae, Template
from fpmatch.pointset.similarity import Similarity

NEARLY_IN_PLACE = Similarity(1.0, 0.05, 3.0, 4.0)


def template(count=40, quality=80):
    x = np.linspace(10, 290, count)
    return Template(Minutiae(x, x, np.zeros(count), quality=np.full(count, quality)), 300, 300)


def verification(
    probe=None, transform=NEARLY_IN_PLACE, agreement=0.7, overlap=0.9, rms_px=2.0, reason="", **more
):
    measured = (np.zeros((12, 2), np.int32), rms_px, agreement, overlap, reason)
    return Verification(
        match=False,
        score=5.0,
        fmr=0.3,
        threshold=40.0,
        matcher="unit-circle",
        comparison=Comparison(0.0, transform, *measured),
        probe=probe or template(),
        reference=more.get("reference") or template(),
    )


def test_nothing_stands_out():
    assert explain_false_non_match(verification()) == ("12 pairs of minutiae; nothing stands out",)
    # A difference of resolution is no change of size.
    half = Template(template().minutiae, 300, 300, dpi=250)
    found = verification(probe=half, transform=Similarity(2.0, 0.0, 0.0, 0.0))
    assert explain_false_non_match(found) == ("12 pairs of minutiae; nothing stands out",)


def test_each_cause_is_named():
    assert explain_false_non_match(verification(probe=template(7))) == (
        "the probe has only 7 minutiae",
    )
    (poor,) = explain_false_non_match(verification(reference=template(quality=20)))
    assert poor == "the reference is poor: its minutiae have a median quality of 20"
    assert "overlap by only 31%" in explain_false_non_match(verification(overlap=0.31))[0]
    assert "only 12% of the minutiae" in explain_false_non_match(verification(agreement=0.12))[0]
    assert "lie 7.5 px" in explain_false_non_match(verification(rms_px=7.5))[0]


def test_the_matchers_own_reason_comes_with_the_rest():
    found = explain_false_non_match(verification(reason="too few agree", overlap=0.2))
    assert found[0] == "too few agree"
    assert len(found) == 2
    assert explain_false_non_match(verification(transform=None, reason="no ridges")) == (
        "no ridges",
    )


def test_a_wrong_placement_makes_other_measures_idle():
    turned = verification(transform=Similarity(1.0, 3.0, 0.0, 0.0), overlap=0.1, agreement=0.1)
    assert explain_false_non_match(turned) == ("placed wrongly, it seems: after a turn by 172°",)
    grown = verification(transform=Similarity(1.25, 0.0, 0.0, 0.0))
    assert explain_false_non_match(grown) == (
        "placed wrongly, it seems: after a change of size by +25%",
    )


def test_impostors_that_agree():
    found = explain_false_match(verification(overlap=0.3, transform=Similarity(1.0, 2.0, 0.0, 0.0)))
    assert found == (
        "12 pairs, 70% of the minutiae where they overlap, agree by chance",
        "they overlap by only 30% of the smaller print, which leaves little to disagree",
        "only after a turn by 115°",
    )


def test_the_worst_come_first_and_each_print_once(report):
    row = report.sets[0]
    report = replace(report, sets=(row,))
    for genuine in (True, False):
        worst = hardest_pairs(report, 4, genuine=genuine)
        values = [pair.similarity for pair in worst]
        assert values == sorted(values, reverse=not genuine)
        named = [name for pair in worst for name in (pair.probe, pair.reference)]
        assert len(named) == len(set(named))
        assert "1_2.tif" not in named
        compared = row.outcomes["reason"] != "no template"
        every = row.outcomes["similarity"][(row.pairs.genuine == genuine) & compared]
        assert values[0] == (every.min() if genuine else every.max())
        assert all(("unknown matcher 'fake'" in pair.causes[0]) for pair in worst)


def printed(path, dpi):
    """Extract minutiae that lie where a picture's name says, with nothing to look at."""
    finger, number = map(int, path.stem.split("_"))
    rng = np.random.default_rng(finger)
    moved = np.random.default_rng([finger, number]).normal(0, 1, (24, 2))
    xy = rng.uniform(20, 130, (24, 2)) + moved
    return Template(Minutiae(*xy.T, rng.uniform(0, 6, 24)), 150, 150)


def test_the_worst_are_drawn_and_explained(tmp_path):
    for finger, number in itertools.product((1, 2, 3), (1, 2)):
        noise = np.random.default_rng([finger, number]).integers(0, 255, (150, 150), np.uint8)
        Image.fromarray(noise).save(tmp_path / f"{finger}_{number}.png")
    report = evaluate([tmp_path], extractor=printed, workers=1)
    (worst, *_) = hardest_pairs(report, 1, genuine=False)
    assert worst.picture[8:12] == b"WEBP"
    assert worst.score is not None
    assert worst.causes
    (tmp_path / worst.probe).unlink()
    (again, *_) = hardest_pairs(report, 1, genuine=False)
    assert again.picture == b""
    assert again.causes[-1].startswith("not drawn: ")
