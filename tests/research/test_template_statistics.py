from dataclasses import replace

import numpy as np
import pytest

from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.templates.minutiae import Minutiae
from research.experiments.template_statistics import TITLES, Group, compare_non_mates, describe
from research.tables.synthesis import format_templates

MIDDLE = 2  # of the quantiles


def group(name, fingers, impressions=2, seed=9, **options):
    templates = list(make_templates(seed, range(fingers), impressions, **options))
    return Group(name, templates, [(seed, f) for f in range(fingers) for _ in range(impressions)])


@pytest.fixture(scope="module")
def made():
    return group("made", 30)


def test_a_known_disturbance_is_measured():
    rng = np.random.default_rng(0)
    originals = list(make_templates(4, range(20), preset="clean"))
    moved = []
    for t in originals:
        m, n = t.minutiae, len(t)
        dx, dy, turn = rng.normal(0, 2, n), rng.normal(0, 2, n), np.radians(5)
        moved.append(replace(t, minutiae=Minutiae(m.x + dx, m.y + dy, m.angle + turn, m.kind)))
    both = [t for pair in zip(originals, moved, strict=True) for t in pair]
    found = describe(Group("moved", both, [k // 2 for k in range(len(both))]))
    middle = {name: q[MIDDLE] for name, q in found["quantiles"].items()}
    assert found["prints"] == 40
    assert found["mates"] == 20
    assert middle["place_px"] == pytest.approx(2 * np.sqrt(2 * np.log(2)), rel=0.15)
    assert middle["direction_deg"] == pytest.approx(5, abs=0.7)
    assert middle["kind"] == 1
    assert middle["overlap"] > 0.95
    assert middle["ridges"] > 0.8


def test_synthetic_templates_stay_near_real_ones(made):
    """Medians as docs/data/synthesis.json has them of real prints, within their usual spread."""
    found = describe(made)["quantiles"]
    for name, low, high in (
        ("minutiae", 26, 42),
        ("area_mm2", 140, 230),
        ("spacing_px", 18, 27),
        ("flow_deg", 2.5, 5.5),
        ("bifurcations", 0.4, 0.56),
        ("paired", 0.68, 0.86),
        ("direction_deg", 2.5, 4.5),
        ("ridges", 0.52, 0.66),
        ("mated", 22, 30),
    ):
        assert low < found[name][MIDDLE] < high, name


def test_non_mates_are_those_of_other_fingers(made):
    few = Group("few", made.templates[:6], made.finger[:6])
    same, more = compare_non_mates(few, [few, made])
    assert same["pairs"] == 6 * 4
    assert more["pairs"] == 6 * 58
    assert more["similarity"][0] < 1
    assert same["fmr"][0] == 2 / 24  # one pair, both ways


def test_tables_have_a_row_for_each_statistic(made):
    few = Group("few", made.templates[:6], made.finger[:6])
    text = format_templates({"groups": [describe(few)], "non_mates": compare_non_mates(few, [few])})
    assert all(title in text for title, _ in TITLES.values())
