"""Matchers that want the image, as the guide's SIFT does: given it, or refused in one line."""

import cv2
import numpy as np
import pytest
from plugin_packages import ROOT

from fpmatch import api, extract, save_template
from fpmatch.errors import DatasetError, MatcherError
from fpmatch.gallery.batch.score import score
from fpmatch.image.io.read import read_image
from fpmatch.lab.evaluation.run import evaluate, evaluate_matchers
from fpmatch.matching.calibration import Calibration
from fpmatch.matching.registry import get_matcher
from fpmatch.matching.result import Matcher, nothing_found
from fpmatch.matching.verify import verify

SAMPLES = ROOT / "sample_data"
FILES = sorted(SAMPLES.glob("10[12]_[1-4].tif"))
CURVE = Calibration(((0.0, 0.0), (5.0, 30.0)), tail_scale=1.0)


@pytest.fixture
def sift(monkeypatch):
    """Return the matcher in the guide's file."""
    monkeypatch.syspath_prepend(ROOT / "docs" / "how-to" / "one_file")
    return get_matcher("sift:MATCHER")


def test_evaluate_measures_the_matcher_of_the_guide_and_it_is_symmetric(sift):
    usual, narrow = evaluate_matchers(
        [SAMPLES], ["sift:MATCHER", "sift:MATCHER:near=3"], protocol="fvc", workers=1
    )
    assert (usual.matcher, narrow.matcher) == ("sift", "sift:near=3")
    assert usual.sets[0].rates.eer < 0.2
    similarities = [one.scores[0].trials.similarity for one in (usual, narrow)]
    assert (similarities[0] != similarities[1]).any()
    first, *others = [sift.prepare(extract(path), read_image(path).pixels) for path in FILES]
    for other in others:
        there, back = sift.compare(first, other), sift.compare(other, first)
        assert back.similarity == there.similarity
        assert sorted(back.pairs.tolist()) == sorted(there.pairs[:, ::-1].tolist())
        if there.transform is not None:
            assert np.allclose(back.transform.inverse().matrix, there.transform.matrix)


def test_without_images_it_is_refused_in_one_line(sift, tmp_path, run, gallery):
    a, b = (extract(path) for path in FILES[:2])
    save_template(tmp_path / "101_1.iso", a)
    save_template(tmp_path / "101_2.iso", b)
    refusals = {
        "sift compares images: a template is not enough": lambda: verify(
            a, b, matcher=sift, calibration=CURVE
        ),
        "sift compares images: score keeps templates alone": lambda: score(
            tmp_path, tmp_path, tmp_path / "scores.csv", matcher=sift
        ),
        "sift compares images: a gallery has templates alone": lambda: evaluate(
            [gallery], matcher=sift, workers=1
        ),
        "_1.iso: is a template, and the matcher compares": lambda: evaluate(
            [tmp_path], matcher=sift, workers=1
        ),
    }
    for reason, call in refusals.items():
        with pytest.raises((MatcherError, DatasetError)) as caught:
            call()
        assert reason in str(caught.value)
    curve = tmp_path / "curve.json"
    curve.write_text(CURVE.as_json())
    words = FILES[0], "--matcher", "sift:MATCHER", "--calibration", curve
    for command in (["identify", gallery], ["verify", "--gallery", gallery, "--subject", 1]):
        result = run(*command, *words)
        assert result.exit_code == 2
        assert "sift compares images: " in result.stderr


def test_the_image_is_that_of_the_file_with_dark_ridges(tmp_path):
    for path in FILES[:2]:
        cv2.imwrite(str(tmp_path / f"{path.stem}.png"), 255 - read_image(path).pixels)
    (tmp_path / "dataset.toml").write_text("dpi = 500\n")
    seen = []

    class Recording(Matcher):
        name, wants_image = "recording", True

        def prepare(self, template, image):
            seen.append((template, image))

        def compare(self, probe, reference):
            return nothing_found("recorded")

    evaluate([tmp_path], matcher=Recording(), workers=1)
    arrays = [read_image(path).pixels for path in FILES[:2]]
    api.verify(*arrays, matcher=Recording(), calibration=CURVE, dpi=500)
    for (template, image), pixels in zip(seen, arrays * 2, strict=False):
        assert image.shape == (template.height, template.width)
        assert (image == pixels).all()
    assert len(seen) >= 4
