"""Verification of prints whose resolution nothing states."""

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from fpmatch.image.io.grey import GreyImage
from fpmatch.matching.scale import CANDIDATE_RATIOS
from fpmatch.matching.verify import verify
from fpmatch.prints import pair as pair_module
from fpmatch.prints.pair import verify_given
from fpmatch.prints.reading import GivenPrint, dpi_source, make_given_print

SAMPLES = Path(__file__).parents[2] / "sample_data"


def pixels_at(name, dpi):
    """Return a sample print, of 500 dpi, as the pixels of an image of another resolution."""
    with Image.open(SAMPLES / name) as image:
        grey = np.asarray(image.convert("L"))
    how = cv2.INTER_AREA if dpi < 500 else cv2.INTER_CUBIC
    return cv2.resize(grey, None, fx=dpi / 500, fy=dpi / 500, interpolation=how)


def unstated(name, dpi):
    return make_given_print(GreyImage(pixels_at(name, dpi)), name)


def stated(name, dpi):
    return make_given_print(GreyImage(pixels_at(name, dpi), dpi), name)


@pytest.mark.parametrize(
    ("dpi", "reference_dpi"), [(250, 250), (363, 500), (569, 500), (700, 500), (1000, 500)]
)
def test_a_match_finds_the_resolution(dpi, reference_dpi):
    reference = stated("101_3.tif", reference_dpi)
    pair = verify_given(unstated("101_1.tif", dpi), reference)
    assert pair.verification.decision == "match"
    found = pair.probe.template.dpi
    assert found == pair.verification.probe.dpi
    assert found == (pytest.approx(700, rel=0.06) if dpi == 700 else dpi)  # by the scale alone
    assert (pair.probe.dpi_source, pair.reference) == ("found", reference)
    assert pair.as_dict()["resolution"] == {
        "probe": {"dpi": found, "source": "found"},
        "reference": {"dpi": reference_dpi, "source": "stated"},
    }
    right = verify_given(stated("101_1.tif", dpi), reference)
    assert 40 <= pair.verification.score <= right.verification.score


@pytest.fixture
def verified(monkeypatch):
    """Return the list of (allowance, score) of all verifications to come."""
    calls = []

    def recorded(*templates, allowance=0.0, **options):
        found = verify(*templates, allowance=allowance, **options)
        calls.append((allowance, found.score))
        return found

    monkeypatch.setattr("fpmatch.prints.pair.verify", recorded)
    return calls


def test_all_kinds_of_tries_together_have_the_stated_rate(verified, monkeypatch):
    ratios = [(1, 1)] * len(CANDIDATE_RATIOS)
    monkeypatch.setattr(pair_module, "_by_scale", lambda _: ratios)
    monkeypatch.setattr(pair_module, "_other_resolutions", lambda *_: [(1, 1)] * 3)
    monkeypatch.setattr(GivenPrint, "at", lambda self, _: self)
    pair = verify_given(unstated("101_1.tif", 500), unstated("102_1.tif", 500))
    assert pair.verification.decision == "no match"
    assert pair.verification.dpi_assumed == ("probe", "reference")
    assert len(verified) == 1 + 3 + len(ratios)
    assert sum(10 ** (-lowered / 10) for lowered, _ in verified) == pytest.approx(1.0)


@pytest.mark.parametrize("dpi", [500, 363])
def test_templates_of_unknown_resolution_are_compared_once_and_keep_that(verified, dpi):
    sides = [
        GivenPrint(one.name, one.template, dpi_source=dpi_source(one.template)[0])
        for one in (unstated("101_1.tif", dpi).at(dpi), unstated("101_3.tif", 500))
    ]
    pair = verify_given(*sides)
    assert [lowered for lowered, _ in verified] == [0.0]
    assert pair.verification.match
    assert pair.verification.dpi_assumed == ("probe", "reference")
    assert sides[0].dpi_source == ("assumed" if dpi == 500 else "found")


def test_a_score_at_another_resolution_is_lower_by_the_tries():
    probe, reference = unstated("101_1.tif", 363), stated("101_3.tif", 500)
    pair = verify_given(probe, reference)
    right = verify_given(stated("101_1.tif", 363), reference).verification
    lower = right.score - pair.verification.score
    assert lower >= 10 * np.log10(1 / 0.06) - 1e-9  # of the other usual resolutions
    assert pair.verification.fmr == pytest.approx(10 ** (-pair.verification.score / 10))
    above = pair.verification.score + 0.5
    assert not verify_given(probe, reference, threshold=above).verification.match


def test_verify_says_which_and_how_it_is_known(run, tmp_path):
    for name, dpi in (("101_1.tif", 363), ("101_3.tif", 500)):
        Image.fromarray(pixels_at(name, dpi)).save(tmp_path / f"{name}.png")
    files = tmp_path / "101_1.tif.png", tmp_path / "101_3.tif.png"
    result = run("verify", *files)
    assert result.exit_code == 0
    line = "  Resolution  of the probe 363 dpi, by the ridges; of the reference 500 dpi, assumed"
    assert line in result.stdout.splitlines()
    assert "resolution unknown; 363 dpi by its ridges and the match" in result.stderr
    given = run("verify", *files, "--probe-dpi", 363, "--reference-dpi", 500, "--json")
    sources = json.loads(given.stdout)["resolution"]
    assert {one["source"] for one in sources.values()} == {"given"}


@pytest.mark.parametrize("dpi", [1500, 2000, 3000, 4000])
def test_a_large_image_has_one_resolution_that_options_accept(run, tmp_path, dpi):
    Image.fromarray(pixels_at("101_1.tif", dpi)).save(tmp_path / "big.png")
    reference = SAMPLES / "101_2.tif"
    found = run("verify", tmp_path / "big.png", reference, "--reference-dpi", 500)
    assert (found.exit_code, "Scale " in found.stdout) == (0, False)
    named = set(re.findall(r"(\d+) dpi", found.output)) - {"500"}
    (value,) = map(int, named)
    assert value == pytest.approx(dpi, rel=0.08)
    assert "wrong resolution" not in found.output
    again = run("verify", tmp_path / "big.png", reference, "--probe-dpi", value)
    assert again.exit_code == 0


@pytest.mark.parametrize("dpi", [250, 500, 1000])
def test_ridges_indicate_the_resolution_of_one_print(dpi):
    given, usual = unstated("101_1.tif", dpi), dpi == 500
    assert given.template.dpi == dpi
    assert given.dpi_source == ("assumed" if usual else "found")
    assert (given.dpi_stated, given.dpi_assumed) == (False, usual)
    note = "500 dpi assumed" if usual else f"{dpi} dpi by its ridges"
    assert f"resolution unknown; {note}" in given.notes
    blank = make_given_print(GreyImage(np.full((300, 300), 200, np.uint8)), "blank")
    assert (blank.template.dpi, blank.dpi_source) == (500, "assumed")


def test_what_is_stated_is_kept_and_a_template_has_one_resolution(template):
    probe = stated("101_1.tif", 363)
    wrong = make_given_print(GreyImage(probe.image.pixels), "wrong", dpi=500)
    pair = verify_given(wrong, stated("101_3.tif", 500))
    assert pair.verification.decision == "no match"
    assert (pair.probe, pair.probe.dpi_source) == (wrong, "given")
    given = GivenPrint("a", template, dpi_source="assumed")
    assert given.at(250) is given
    assert given.ridge_period_px is None
    assert verify_given(unstated("101_1.tif", 363), given).reference is given
