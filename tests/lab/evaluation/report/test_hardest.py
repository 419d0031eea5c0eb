import itertools
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from fpmatch.lab.evaluation.report.hardest import (
    explain_false_match,
    explain_false_non_match,
    hardest_pairs,
)
from fpmatch.lab.evaluation.run import evaluate
from fpmatch.matching.verify import Verification
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template

NEARLY_IN_PLACE = Similarity(1.0, 0.05, 3.0, 4.0)


def template(count=40, quality=80, dpi=500):
    x = np.linspace(10, 290, count)
    minutiae = Minutiae(x, x, np.zeros(count), quality=np.full(count, quality))
    return Template(minutiae, 300, 300, dpi=dpi)


def verification(
    probe=None, transform=NEARLY_IN_PLACE, agreement=0.7, overlap=0.9, rms_px=2.0, reason="", **more
):
    return Verification(
        match=False,
        score=5.0,
        fmr=0.3,
        threshold=40.0,
        matcher="unit-circle",
        transform=transform,
        pairs=np.zeros((12, 2), np.int32),
        rms_px=rms_px,
        agreement=agreement,
        overlap=overlap,
        reason=reason,
        probe=probe or template(),
        reference=more.get("reference") or template(),
    )


@pytest.mark.parametrize(
    ("measured", "causes"),
    [
        ({}, ["nothing stands out"]),
        # a difference of resolution is no change of size
        ({"probe": template(dpi=250), "transform": Similarity(2.0)}, ["nothing stands out"]),
        ({"probe": template(7)}, ["probe has only 7 minutiae"]),
        ({"reference": template(quality=20)}, ["reference is poor", "quality of 20"]),
        ({"overlap": 0.31}, ["overlap by only 31%"]),
        ({"agreement": 0.12}, ["only 12%"]),
        ({"rms_px": 7.5}, ["7.5 px"]),
        ({"transform": None, "reason": "no ridges"}, ["no ridges"]),
        # a wrong placement makes other measures idle
        ({"transform": Similarity(1.0, 3.0), "overlap": 0.1, "agreement": 0.1}, ["turn by 172°"]),
        ({"transform": Similarity(1.25)}, ["size by +25%"]),
    ],
)
def test_each_cause_is_named_and_no_other(measured, causes):
    (cause,) = explain_false_non_match(verification(**measured))
    assert all(words in cause for words in causes)


def test_the_matchers_own_reason_comes_first():
    reason, other = explain_false_non_match(verification(reason="too few agree", overlap=0.2))
    assert (reason, "20%" in other) == ("too few agree", True)


def test_impostors_that_agree():
    found = explain_false_match(verification(overlap=0.3, transform=Similarity(1.0, 2.0, 0.0, 0.0)))
    assert len(found) == 3
    for words, cause in zip(("12 pairs, 70%", "only 30%", "turn by 115°"), found, strict=True):
        assert words in cause


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
