"""`fpmatch.prints.report`: numbers that are none never reach the JSON, nor odd words the eye."""

import json
import math
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from fpmatch import Minutiae, Template, as_template
from fpmatch.matching.constants import COMPILED
from fpmatch.matching.result import Compared
from fpmatch.matching.verify import Verification, verify
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.prints.report import as_dict, as_text, odds


def verification(template, transform, rms_px, reason="", compared=None):
    pairs = np.array([[0, 1], [2, 3]], np.int32)
    match, score = bool(np.bool_(transform is not None)), np.float64(52.3)
    found = {"transform": transform, "pairs": pairs, "rms_px": rms_px, "reason": reason}
    found |= {"agreement": 0.816, "overlap": 0.74, "compared": compared}
    return Verification(match, score, 5.9e-6, 40.0, "unit-circle", template, template, **found)


# Each number beside a decision, derived anew from the templates, the pairs and the transform.

SAMPLES = Path(__file__).parents[2] / "sample_data"
NAMES = [path.stem for path in sorted(SAMPLES.glob("10*.tif"))]
GENUINE = [(a, b) for a, b in combinations(NAMES, 2) if a[:3] == b[:3]]
IMPOSTORS = [(a, b) for a, b in combinations(NAMES, 2) if a[3:] == b[3:] == "_1" and a != b]
FORMS = ("as extracted", "without ridges", "of 1000 dpi")
STRIDE = 1 if COMPILED else 12  # interpreted kernels take long


@cache
def sample(name):
    return as_template(SAMPLES / f"{name}.tif")


def enlarged(template, zoom=2.0):
    """Return the template of the same print at `zoom` times the resolution."""
    m, f = template.minutiae, template.field
    minutiae = Minutiae(m.x * zoom, m.y * zoom, m.angle, m.kind, m.quality)
    size = int(template.width * zoom), int(template.height * zoom)
    field = replace(f, step=f.step * zoom)
    return Template(minutiae, *size, dpi=template.dpi * zoom, field=field)


@cache
def compared_pair(names, form):
    probe, reference = map(sample, names)
    if form == "without ridges":
        probe, reference = replace(probe, field=None), replace(reference, field=None)
    if form == "of 1000 dpi":
        probe = enlarged(probe)
    return verify(probe, reference)


def xy_of(template):
    return np.stack([template.minutiae.x, template.minutiae.y], axis=1).astype(np.float64)


def holds(template, xy):
    """Return which places lie in a print: on its ridges, else in the hull of its minutiae."""
    if template.field is None:
        return Delaunay(xy_of(template)).find_simplex(xy) >= 0
    mask, at = template.field.mask, np.floor(xy / template.field.step).astype(int)
    in_frame = (at >= 0).all(axis=1) & (at < mask.shape[::-1]).all(axis=1)
    column, row = np.where(in_frame[:, None], at, 0).T
    return in_frame & mask[row, column]


EVERY = [(names, form) for form in FORMS for names in (*GENUINE, *IMPOSTORS)][::STRIDE]


@pytest.mark.parametrize(("names", "form"), EVERY)
def test_pairs_agreement_and_residual_are_those_of_the_transform(names, form):
    v = compared_pair(names, form)
    probe, reference = v.probe, v.reference
    moved, back = v.transform.apply(xy_of(probe)), v.transform.inverse().apply(xy_of(reference))
    i, j = v.pairs.T
    assert len(set(i)) == len(set(j)) == len(v.pairs)
    distances = np.hypot(*(moved[i] - xy_of(reference)[j]).T)
    assert v.rms_px == pytest.approx(np.sqrt(np.mean(distances**2)), abs=1e-3)
    assert v.matched_share == len(v.pairs) / min(len(probe.minutiae), len(reference.minutiae))
    ours, theirs = holds(reference, moved), holds(probe, back)
    ours[i] = theirs[j] = True
    inside = int(ours.sum() + theirs.sum())
    # a minutia at the rim lies in or out as the skin is stretched there; a hull is made of cells
    rim = 0.09 if probe.field is not None else 0.16
    assert v.compared.minutiae == pytest.approx(inside, abs=max(2, rim * inside))
    assert v.agreement == 2 * len(v.pairs) / v.compared.minutiae
    pairs = f"{len(v.pairs)} pairs among the {v.compared.minutiae} minutiae"
    assert v.match or v.shortage or pairs in v.reason
    if probe.field is not None:
        area = min(
            one.field.mask.sum() * (one.field.step * 25.4 / one.dpi) ** 2
            for one in (probe, reference)
        )
        assert v.compared.area_mm2 == pytest.approx(v.overlap * area)


def test_without_a_transform_there_is_a_reason_and_strict_json(template):
    for rms_px in (float("nan"), float("inf"), 0.0):
        found = verification(template, None, rms_px, "no common region")
        lines = as_text(found).splitlines()
        assert (lines[0], lines[-1]) == ("NO MATCH", "  Reason      no common region")
        assert not any("px" in line for line in lines)
        document = as_dict(found, Path("a.png"), Path("b.png"))
        assert json.loads(json.dumps(document, allow_nan=False)) == document
        assert (document["transform"], document["rms_px"], document["pairs"]) == (None, None, 2)


def test_text_and_json_of_a_match(template):
    move = Similarity(1.004, -0.2, 12.4, -5.1)
    lines = [
        "MATCH",
        "  Score       52.3 on a scale to 100; a match needs 40.0",
        "  FMR         1 in 170,000 pairs of different fingers scores as high",
        "  Minutiae    2 pairs among 30 of the probe and 30 of the reference",
        "  Agreement   82% of the minutiae where the prints overlap are paired",
        "  Overlap     74% of the smaller print",
        "  Transform   rotation -11.5° (counter-clockwise), scale 1.004, "
        "shift +12.4 px right, -5.1 px down",
        "  Residual    2.1 px rms",
    ]
    plain = verification(template, move, 2.13)
    assert as_text(plain).splitlines() == lines
    assert as_dict(plain, "a", "b")["compared"] is None
    for agreement, area, words in ((0.562, 86.2, "agreement 0.56 on 86 mm²"), (None, 0.0, "")):
        found = verification(template, move, 2.13, compared=Compared(44, 93.4, agreement, area))
        shown = f"  Ridges      {words or 'not compared'}"
        assert as_text(found).splitlines()[5:7] == [f"{lines[5]}, 93 mm²", shown]
        assert as_dict(found, "a", "b")["compared"] == {
            **{"minutiae": 44, "area_mm2": 93.4, "ridge_agreement": agreement},
            "ridge_area_mm2": area,
        }


@given(st.floats(1e-10, 0.95))
def test_odds_are_right_to_two_digits(fmr):
    count, *unit = odds(fmr).removeprefix("1 in ").split()
    size = {"million": 1e6, "billion": 1e9}[unit[0]] if unit else 1
    assert float(count.replace(",", "")) * size == pytest.approx(1 / fmr, rel=0.051)
    words = {1.0: "nearly all", 0.0123: "1 in 81", 1 / 999_999: "1 in 1 million"}
    words |= {1e-8: "1 in 100 million", 0.0: "unknown", -1.0: "unknown", math.nan: "unknown"}
    assert {rate: odds(rate) for rate in words} == words
