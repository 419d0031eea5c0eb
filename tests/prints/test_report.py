"""`fpmatch.prints.report`: numbers that are none never reach the JSON, nor odd words the eye."""

import json
import math
import re
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.spatial import Delaunay
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from fpmatch import Minutiae, Template, as_template
from fpmatch.matching.calibration import Calibration, load_calibration
from fpmatch.matching.compiled import COMPILED
from fpmatch.matching.pipeline import evidence
from fpmatch.matching.result import Compared, Comparison
from fpmatch.matching.verification import Verification
from fpmatch.matching.verify import verify
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.prints.report import as_dict, as_rows, as_text, odds


def verification(template, transform, rms_px, reason="", compared=None):
    pairs = np.array([[0, 1], [2, 3]], np.int32)
    similarity, agreement, overlap = 5.0, 0.816, 0.74
    found = Comparison(
        similarity, transform, pairs, rms_px, agreement, overlap, reason, compared=compared
    )
    match, score = bool(np.bool_(transform is not None)), np.float64(52.3)
    return Verification(match, score, 5.9e-6, 40.0, "unit-circle", found, template, template)


def test_text_of_a_match(template):
    found = verification(template, Similarity(1.004, -0.2, 12.4, -5.1), 2.13)
    assert as_text(found).splitlines() == [
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


def test_text_and_json_contain_how_much_was_compared(template):
    move = Similarity(1.0, 0.0, 0.0, 0.0)
    compared = Compared(44, 93.4, 0.562, 86.2)
    lines = as_text(verification(template, move, 2.0, compared=compared)).splitlines()
    assert lines[5:7] == [
        "  Overlap     74% of the smaller print, 93 mm²",
        "  Ridges      agreement 0.56 on 86 mm²",
    ]
    compared = Compared(44, 93.4, None, 0.0)
    found = verification(template, move, 2.0, compared=compared)
    assert as_text(found).splitlines()[6] == "  Ridges      not compared"
    assert as_dict(found, "a", "b")["compared"] == {
        **{"minutiae": 44, "area_mm2": 93.4, "ridge_agreement": None},
        "ridge_area_mm2": 0.0,
    }
    assert as_dict(verification(template, move, 2.0), "a", "b")["compared"] is None


def test_text_without_a_transform(template):
    lines = as_text(verification(template, None, float("nan"), "no common region")).splitlines()
    assert lines[0] == "NO MATCH"
    assert lines[-1] == "  Reason      no common region"
    assert not any("px" in line for line in lines)


def test_the_dict_is_strict_json(template):
    for rms_px in (float("nan"), float("inf"), 0.0):
        found = verification(template, None, rms_px, "no common region")
        document = as_dict(found, Path("a.png"), Path("b.png"))
        assert json.loads(json.dumps(document, allow_nan=False)) == document
        assert document["transform"] is None
        assert document["rms_px"] is None
        assert document["pairs"] == 2


@pytest.mark.parametrize(
    ("fmr", "expected"),
    [
        (1.0, "nearly all"), (0.94, "1 in 1.1"),
        (0.5, "1 in 2"), (0.01, "1 in 100"), (0.0123, "1 in 81"),
        (1e-3, "1 in 1,000"), (1 / 999_999, "1 in 1 million"), (2.5e-7, "1 in 4 million"),
        (1e-8, "1 in 100 million"), (1e-10, "1 in 10 billion"),
        (0.0, "unknown"), (-1.0, "unknown"), (math.nan, "unknown"),
    ],
)  # fmt: skip
def test_odds_in_words(fmr, expected):
    assert odds(fmr) == expected


@given(st.floats(1e-10, 0.95))
def test_odds_are_right_to_two_digits(fmr):
    count, *unit = odds(fmr).removeprefix("1 in ").split()
    size = {"million": 1e6, "billion": 1e9}[unit[0]] if unit else 1
    assert float(count.replace(",", "")) * size == pytest.approx(1 / fmr, rel=0.051)


# Each number beside a decision, derived anew from the templates, the pairs and the transform.

SAMPLES = Path(__file__).parents[2] / "sample_data"
NAMES = [path.stem for path in sorted(SAMPLES.glob("10*.tif"))]
GENUINE = [(a, b) for a, b in combinations(NAMES, 2) if a[:3] == b[:3]]
IMPOSTORS = [(a, b) for a, b in combinations(NAMES, 2) if a[3:] == b[3:] == "_1" and a != b]
SCORE_DATA = Path(evidence.__file__).with_name("score_data") / "unit-circle.json"
FORMS = ("as extracted", "without ridges", "of 1000 dpi", "other calibration")
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
def calibration(form):
    if form != "other calibration":
        return load_calibration("unit-circle")
    return Calibration(((0.0, 0.0), (2.0, 11.0), (9.0, 31.0)), 0.9, 0.2)


@cache
def compared_pair(names, form):
    probe, reference = map(sample, names)
    if form == "without ridges":
        probe, reference = replace(probe, field=None), replace(reference, field=None)
    if form == "of 1000 dpi":
        probe = enlarged(probe)
    return verify(probe, reference, calibration=calibration(form))


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


def middles(template):
    row, column = np.nonzero(template.field.mask)
    return (np.stack([column, row], axis=1) + 0.5) * template.field.step


def cell_mm2(template):
    return (template.field.step * 25.4 / template.dpi) ** 2


def rigid(template, other, pairs):
    """Return the rotation and shift that bring paired minutiae together, with no scale, in mm."""
    ours, theirs = (
        xy_of(side)[pairs[:, k]] * (25.4 / side.dpi) for k, side in enumerate((template, other))
    )
    centres = ours.mean(axis=0), theirs.mean(axis=0)
    turn, _ = Rotation.align_vectors(
        *(
            np.column_stack([one - mid, np.zeros(len(one))])
            for one, mid in ((theirs, centres[1]), (ours, centres[0]))
        )
    )
    matrix = turn.as_matrix()[:2, :2]
    return lambda xy: (
        ((xy * (25.4 / template.dpi) - centres[0]) @ matrix.T + centres[1]) * (other.dpi / 25.4)
    )


def every(pairs=(*GENUINE, *IMPOSTORS), forms=FORMS):
    return [(names, form) for form in forms for names in pairs][::STRIDE]


@pytest.mark.parametrize(("names", "form"), every())
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


@pytest.mark.parametrize(("names", "form"), every(forms=("as extracted", "of 1000 dpi")))
def test_overlap_is_the_part_of_the_smaller_print_inside_the_other(names, form):
    v = compared_pair(names, form)
    sides = v.probe, v.reference
    smaller = min(one.field.mask.sum() * cell_mm2(one) for one in sides)
    assert v.compared.area_mm2 == pytest.approx(v.overlap * smaller)
    move = rigid(*sides, v.pairs)  # the resolutions are taken to be right, so nothing is scaled
    inside = holds(v.reference, move(middles(v.probe))).sum() * cell_mm2(v.probe)
    assert v.overlap == pytest.approx(min(inside / smaller, 1.0), abs=0.07)


@pytest.mark.parametrize(("names", "form"), every())
def test_the_false_match_rate_is_that_of_the_curve(names, form):
    v = compared_pair(names, form)
    curve = json.loads(calibration(form).as_json())
    x, score = np.array(curve["knots"]).T
    excess = max(v.comparison.similarity - x[-1], 0.0) / curve["tail_scale"]
    tail = stats.genpareto.logsf(excess, curve["tail_shape"]) / np.log(10)
    expected = np.interp(v.comparison.similarity, x, score) - 10 * tail
    assert v.score == pytest.approx(min(expected, 100.0), abs=1e-6)
    assert v.fmr == pytest.approx(10 ** (-v.score / 10))
    assert v.smallest_measured_fmr == pytest.approx(10 ** (-score[-1] / 10))
    assert v.extrapolated == (v.score > score[-1])
    assert v.match == (v.score >= 40.0 == v.threshold)  # one in 10,000
    text = as_text(v)
    assert ("extrapolated" in text) == v.extrapolated
    assert f"  Score       {v.score:.1f} on a scale to 100; a match needs 40.0" in text


@pytest.mark.parametrize("claimed", [400, 625, 700])
def test_the_scale_is_that_of_the_distances(claimed):
    probe, reference = sample("101_1"), replace(sample("101_4"), dpi=claimed)
    v = verify(probe, reference)
    assert v.scale.differs
    right = verify(probe, sample("101_4"))
    i, j = right.pairs.T
    ours = pdist(xy_of(probe)[i]) / probe.dpi
    theirs = pdist(xy_of(reference)[j]) / reference.dpi
    assert v.scale.ratio == pytest.approx(np.exp(np.median(np.log(theirs / ours))), rel=0.02)
    row = dict(as_rows(v))["Scale"]
    assert f"{v.scale.ratio:.2f} times as large as the probe" in row
    assert f"reference of about {claimed * v.scale.ratio:.0f}, not {claimed}" in row


def typical_score(model, minutiae, area_px2):
    """Return the score that half of the genuine pairs of so much skin reach, from the file."""

    def saturated(amount, enough):
        return amount / (1 + (amount / enough) ** 4) ** 0.25

    n, a = saturated(minutiae, 12.0), max(saturated(area_px2, 30_000.0), 256.0)
    x, y = 1 / (n + 1), math.log(a / 10_000)
    median = np.dot(list(model["genuine_median"].values()), [1, x, x * x, y, x * y])
    return load_calibration("unit-circle").score(np.logaddexp(0.0, median))


@pytest.mark.parametrize("side_px", [64, 80, 96])
def test_the_amount_needed_reaches_the_threshold_and_less_does_not(side_px):
    whole = sample("101_1")
    keep = np.zeros(whole.field.mask.shape, bool)
    k = side_px // int(whole.field.step)
    keep[10 : 10 + k, 8 : 8 + k] = True
    field = replace(whole.field, mask=whole.field.mask & keep)
    m = whole.minutiae
    chosen = holds(replace(whole, field=field), xy_of(whole))
    part = replace(whole, field=field, minutiae=m[chosen])
    v = verify(part, sample("101_4"))
    if v.match:
        v = verify(part, sample("102_1"))
    assert v.decision == "inconclusive"
    form = r"(\d+) minutiae? on (\d+) mm² .*about (\d+) on (\d+) mm² .* score of 40\.0"
    there, area, needed, needed_area = map(
        int, re.search(form, v.reason.replace("minutia ", "minutiae ")).groups()
    )
    own_area = field.mask.sum() * cell_mm2(part)
    assert (there, area) == (int(chosen.sum()), round(own_area))
    model = json.loads(SCORE_DATA.read_text(encoding="utf-8"))["models"]["small with ridges"]
    px2 = (500 / 25.4) ** 2

    def reaches(factor):
        if factor * own_area * px2 > 30_000:
            return None  # another model: the print is not small any more
        return typical_score(model, factor * there, factor * own_area * px2)

    factor = next(1.1**k for k in range(1, 49) if (found := reaches(1.1**k)) is None or found >= 40)
    assert reaches(factor / 1.1) < 40.0
    assert (needed, needed_area) == (math.ceil(factor * there), round(factor * own_area))


def test_a_reason_has_the_numbers_of_the_evidence():
    for names in IMPOSTORS[::STRIDE]:
        v = compared_pair(names, "as extracted")
        assert f"{len(v.pairs)} pairs among the {v.compared.minutiae} minutiae" in v.reason
        half = v.agreement >= 0.5
        assert ("half of the minutiae or more" in v.reason) <= half


def test_the_quality_of_poor_minutiae_is_their_mean():
    probe = sample("101_1")
    m = probe.minutiae
    poor = Minutiae(m.x, m.y, m.angle, m.kind, (m.quality * 0.3).astype(int))
    v = verify(replace(probe, minutiae=poor), sample("103_1"))
    mean = float(np.mean(poor.quality))
    assert f"the minutiae of the probe are poor (mean quality {mean:.0f})" in v.reason
