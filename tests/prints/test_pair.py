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
from fpmatch.prints.pair import PairOptions, compare_pair, verify_given
from fpmatch.prints.reading import GivenPrint, dpi_source, make_given_print
from fpmatch.templates.minutiae import Template

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


@pytest.mark.parametrize("dpi", [250, 1000])
def test_ridges_indicate_the_resolution_of_one_print(dpi):
    given = unstated("101_1.tif", dpi)
    assert (given.template.dpi, given.dpi_source, given.dpi_stated) == (dpi, "found", False)
    assert f"resolution unknown; {dpi} dpi by its ridges" in given.notes


def test_500_dpi_are_assumed_where_ridges_allow_them():
    given = unstated("101_1.tif", 500)
    assert (given.template.dpi, given.dpi_source, given.dpi_assumed) == (500, "assumed", True)
    blank = make_given_print(GreyImage(np.full((300, 300), 200, np.uint8)), "blank")
    assert (blank.template.dpi, blank.dpi_source) == (500, "assumed")


@pytest.mark.parametrize(
    ("dpi", "reference_dpi"), [(250, 250), (363, 500), (569, 500), (1000, 500)]
)
def test_a_match_finds_the_resolution(dpi, reference_dpi):
    reference = stated("101_3.tif", reference_dpi)
    pair = verify_given(unstated("101_1.tif", dpi), reference)
    assert pair.verification.decision == "match"
    assert pair.probe.template.dpi == pair.verification.probe.dpi == dpi
    assert (pair.probe.dpi_source, pair.reference) == ("found", reference)
    assert pair.as_dict()["resolution"] == {
        "probe": {"dpi": dpi, "source": "found"},
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


@pytest.mark.parametrize(
    "names",
    [("101_1.tif", "102_1.tif"), ("101_1.tif", "101_3.tif"), ("103_2.tif", "104_1.tif")],
)
@pytest.mark.parametrize("sizes", [(500, 500), (363, 500), (1000, 569), (700, 500)])
def test_all_tries_together_have_the_stated_rate(verified, monkeypatch, names, sizes):
    scale = pair_module._by_scale  # stands for the best of so many ratios
    ratios = [(1, 1)] * len(CANDIDATE_RATIOS)
    monkeypatch.setattr(pair_module, "_by_scale", lambda pair: scale(pair) and ratios)
    monkeypatch.setattr(GivenPrint, "at", lambda self, _: self)
    verify_given(*(unstated(*print_) for print_ in zip(names, sizes, strict=True)))
    shares = [10 ** (-lowered / 10) for lowered, _ in verified]
    assert 0 < sum(shares) <= 1 + 1e-9
    assert verified[0][0] == pytest.approx(-10 * np.log10(0.9))  # the first one counts, too


def test_all_kinds_of_tries_together_have_the_stated_rate(verified, monkeypatch):
    ratios = [(1, 1)] * len(CANDIDATE_RATIOS)
    monkeypatch.setattr(pair_module, "_by_scale", lambda _: ratios)
    monkeypatch.setattr(pair_module, "_other_resolutions", lambda *_: [(1, 1)] * 3)
    monkeypatch.setattr(GivenPrint, "at", lambda self, _: self)
    verify_given(unstated("101_1.tif", 500), unstated("102_1.tif", 500))
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


def test_what_is_stated_is_kept():
    probe = stated("101_1.tif", 363)
    wrong = make_given_print(GreyImage(probe.pixels), "wrong", dpi=500)
    pair = verify_given(wrong, stated("101_3.tif", 500))
    assert pair.verification.decision == "no match"
    assert (pair.probe, pair.probe.dpi_source) == (wrong, "given")


def test_different_fingers_do_not_match_at_any(capsys):
    pair = compare_pair(unstated("101_1.tif", 363), unstated("102_1.tif", 500), PairOptions())
    assert pair.verification.decision == "no match"
    assert pair.verification.dpi_assumed == ("probe", "reference")


def test_a_template_has_one_resolution(template):
    given = GivenPrint("a", template, dpi_source="assumed")
    assert given.at(250) is given
    assert given.ridge_period_px is None
    pair = verify_given(unstated("101_1.tif", 363), given)
    assert pair.reference.template.dpi == 500
    assert isinstance(pair.verification.reference, Template)


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


def test_a_resolution_that_is_not_usual_is_found_by_the_scale():
    pair = verify_given(unstated("101_1.tif", 700), stated("101_3.tif", 500))
    assert pair.verification.decision == "match"
    assert pair.probe.template.dpi == pytest.approx(700, rel=0.06)
    assert pair.probe.dpi_source == "found"


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
