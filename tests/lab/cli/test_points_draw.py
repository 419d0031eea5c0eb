"""`fpmatch points draw`: which sets it draws, and what it says."""

import json
import math

import numpy as np
import pytest

from fpmatch.formats.files import save_template
from fpmatch.lab.paper_figures.figures import draw_point_figures, numbers_drawn
from fpmatch.lab.paper_figures.pair import EASY_SEED, random_point_pair, rotated_point_pair
from fpmatch.lab.paper_figures.rings import choose_ring_pair
from fpmatch.lab.paper_figures.sheet import draw_sheets
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template
from tests.conftest import assert_refused

NAMES = [
    f"figure_{name}.svg"
    for name in (
        *("2_triangulations", "3_one_rings", "4_unit_circle", "5_weights"),
        *("6a_two_circles", "6b_rotation", "7_flow_chart"),
    )
]
POINTS = np.random.default_rng(8).uniform(0.0, 100.0, (25, 2))


def saved(path, points):
    np.savetxt(path, points, delimiter=",", header="x,y", comments="", fmt="%.17g")
    return path


@pytest.fixture
def out(tmp_path):
    return tmp_path / "new" / "out"


@pytest.fixture
def draw(run, out, monkeypatch):
    """Return a function that draws the first figure and returns the numbers printed as JSON."""
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(
        "fpmatch.lab.paper_figures.figures.draw_sheets",
        lambda sheets, file_format: draw_sheets(dict([*sheets.items()][:1]), file_format),
    )

    def run_draw(*words):
        result = run("points", "draw", "-o", out, "--json", *words)
        assert result.exit_code == 0, result.output
        numbers = json.loads(result.stdout)
        assert numbers.pop("files") == sorted(map(str, out.iterdir()))
        return numbers

    return run_draw


def as_printed(pair):
    return json.loads(json.dumps(numbers_drawn(pair, choose_ring_pair(pair))))


@pytest.mark.slow
def test_without_files_a_random_pair_is_drawn(run, out):
    pytest.importorskip("matplotlib")
    result = run("points", "draw", "-o", out)
    assert (result.exit_code, result.stderr) == (0, "")
    assert sorted(path.name for path in out.iterdir()) == NAMES
    pair = random_point_pair(EASY_SEED)
    rings = choose_ring_pair(pair)
    for figure in draw_point_figures(pair, rings):
        assert (out / figure.file_name).read_bytes() == figure.content
        assert f"{out / figure.file_name}: " in result.stdout
    matched = numbers_drawn(pair, rings)["matched"]
    assert f"; {matched} of 40 " in result.stdout.splitlines()[-1]


def test_with_two_files_the_matcher_finds_the_partners(draw, out, tmp_path):
    p_csv = saved(tmp_path / "p.csv", POINTS)
    q_csv = saved(tmp_path / "q.csv", Similarity(2.0, -1.2, 7.0, 9.0).apply(POINTS[::-1]))
    pair = rotated_point_pair(POINTS, "points", 1)
    default = choose_ring_pair(pair).p.centre
    ring = next(int(i) for i in pair.p.mesh.interior.nonzero()[0] if i != default)
    printed = draw(p_csv, q_csv, "--ring", ring, "--format", "png")
    assert {path.suffix for path in out.iterdir()} == {".png"}
    assert (printed["p"]["centre"], printed["q"]["centre"]) == (ring, len(POINTS) - 1 - ring)
    assert printed["rotation_deg"]["rings"] == pytest.approx(np.degrees(-1.2))
    assert printed["scale"]["rings"] == pytest.approx(2.0)
    assert printed["matched"] == len(POINTS)


@pytest.mark.parametrize(
    ("name", "words", "y_down"),
    [
        ("template.csv", ["--seed", 5], True),
        ("template.csv", ["--seed", 5, "--y-axis", "up"], False),
        ("points.csv", ["--seed", 5], False),
        ("points.csv", ["--seed", 5, "--y-axis", "down"], True),
    ],
)
def test_a_template_is_drawn_as_its_image_stands(draw, out, tmp_path, name, words, y_down):
    minutiae = Minutiae(*POINTS.T, np.zeros(len(POINTS)))
    xy = minutiae.xy.astype(float)
    save_template(tmp_path / "template.csv", Template(minutiae, 100, 100))
    saved(tmp_path / "points.csv", xy)
    printed = draw(tmp_path / name, *words)
    pair = rotated_point_pair(xy, name, 5, y_down=y_down)
    assert printed == as_printed(pair)
    for rotation in printed["rotation_deg"].values():
        assert rotation == pytest.approx(pair.transform.rotation_deg)
    drawn = (out / NAMES[0]).read_text(encoding="utf-8")
    assert ("y down, as in images" in " ".join(drawn.split())) == y_down


def test_a_template_and_points_need_the_y_axis(draw, run, out, tmp_path):
    minutiae = Minutiae(*POINTS.T, np.zeros(len(POINTS)))
    save_template(tmp_path / "p.csv", Template(minutiae, 100, 100))
    turned = saved(tmp_path / "q.csv", Similarity(1.0, 0.4).apply(minutiae.xy.astype(float)))
    refused = run("points", "draw", tmp_path / "p.csv", turned, "-o", out)
    assert refused.exit_code == 2
    assert "template" in refused.stderr
    rotation = draw(tmp_path / "p.csv", turned, "--y-axis", "down")["rotation_deg"]["sets"]
    assert rotation == pytest.approx(-np.degrees(0.4))  # clockwise on screen


def test_a_mirrored_set_is_drawn_mirrored_on_request(run, draw, tmp_path, out):
    p = saved(tmp_path / "p.csv", POINTS)
    move = Similarity(2.0, 0.5, 300.0, -40.0)
    q = saved(tmp_path / "q.csv", move.apply(POINTS * [1, -1]))
    assert_refused(run("points", "draw", p, q, "-o", out), "match")
    numbers = draw(p, q, "--reflect")
    assert numbers["rotation_deg"]["sets"] == pytest.approx(math.degrees(0.5))
    assert numbers["scale"]["rings"] == pytest.approx(2.0)
    assert numbers["matched"] == len(POINTS)
    drawn = [path.read_text(encoding="utf-8") for path in out.iterdir()]
    assert any("Q is P mirrored, rotated by 28.6°" in " ".join(text.split()) for text in drawn)


def test_reflect_needs_both_sets(run, out):
    assert run("points", "draw", "-o", out, "--reflect").exit_code == 2
