"""`fpmatch points draw`: which sets it draws, what it says, and what becomes of bad input."""

import json
import sys

import numpy as np
import pytest

from fpmatch.drawing.paper_figures.figures import draw_point_figures, numbers_drawn
from fpmatch.drawing.paper_figures.pair import EASY_SEED, random_point_pair, rotated_point_pair
from fpmatch.drawing.paper_figures.rings import choose_ring_pair
from fpmatch.formats.files import save_template
from fpmatch.minutiae import Minutiae, Template
from fpmatch.pointset.similarity import Similarity

from .conftest import assert_refused

NAMES = [
    f"figure_{name}.svg"
    for name in (
        *("2_triangulations", "3_one_rings", "4_unit_circle", "5_weights"),
        *("6a_two_circles", "6b_rotation", "7_flow_chart"),
    )
]
POINTS = np.random.default_rng(8).uniform(0.0, 100.0, (25, 2))


@pytest.fixture
def p_csv(tmp_path):
    return saved(tmp_path / "p.csv", POINTS)


def saved(path, points):
    np.savetxt(path, points, delimiter=",", header="x,y", comments="", fmt="%.17g")
    return path


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_without_files_a_random_pair_is_drawn(run, tmp_path):
    pytest.importorskip("matplotlib")
    out = tmp_path / "new" / "out"
    result = run("points", "draw", "-o", out)
    assert result.exit_code == 0, result.output
    assert names(out) == NAMES
    pair = random_point_pair(EASY_SEED)
    rings = choose_ring_pair(pair)
    for figure in draw_point_figures(pair, rings):
        assert (out / figure.file_name).read_bytes() == figure.content
        assert f"{out / figure.file_name}: {figure.title}\n" in result.stdout
    matched = numbers_drawn(pair, rings)["matched"]
    assert result.stdout.endswith(
        f"Ring of point {rings.p.centre} of P ({len(rings.p)} points), partner: point "
        f"{rings.q.centre} of Q; {matched} of 40 points match\n"
    )
    assert result.stderr == ""


def test_with_one_file_its_rotated_copy_is_the_other_set(run, tmp_path, p_csv):
    pytest.importorskip("matplotlib")
    result = run("points", "draw", p_csv, "-o", tmp_path / "out", "--seed", 5, "--json")
    assert result.exit_code == 0, result.output
    printed = json.loads(result.stdout)
    assert printed.pop("files") == [str(tmp_path / "out" / name) for name in NAMES]
    pair = rotated_point_pair(POINTS, "p.csv", 5)
    assert printed == json.loads(json.dumps(numbers_drawn(pair, choose_ring_pair(pair))))
    for side in "pq":
        assert sum(printed[side]["weights"]) == pytest.approx(1.0)
    for rotation in printed["rotation_deg"].values():
        assert rotation == pytest.approx(pair.transform.rotation_deg)


def test_with_two_files_the_matcher_finds_the_partners(run, tmp_path, p_csv):
    pytest.importorskip("matplotlib")
    move = Similarity(2.0, -1.2, 7.0, 9.0)
    q_csv = saved(tmp_path / "q.csv", move.apply(POINTS[::-1]))
    ring = int(rotated_ring(POINTS))
    options = ("-o", tmp_path / "out", "--ring", ring, "--format", "png", "--json")
    result = run("points", "draw", p_csv, q_csv, *options)
    assert result.exit_code == 0, result.output
    printed = json.loads(result.stdout)
    assert names(tmp_path / "out") == [name.replace(".svg", ".png") for name in NAMES]
    assert (printed["p"]["centre"], printed["q"]["centre"]) == (ring, len(POINTS) - 1 - ring)
    assert printed["rotation_deg"]["rings"] == pytest.approx(np.degrees(-1.2))
    assert printed["scale"]["rings"] == pytest.approx(2.0)
    assert printed["matched"] == len(POINTS)


def test_a_template_is_drawn_as_its_image_stands(run, tmp_path):
    pytest.importorskip("matplotlib")
    minutiae = Minutiae(*POINTS.T, np.zeros(len(POINTS)))
    save_template(tmp_path / "p.csv", Template(minutiae, 100, 100))
    xy = minutiae.xy.astype(float)
    bare = saved(tmp_path / "bare.csv", xy)
    for file, words, y_down in (
        (tmp_path / "p.csv", (), True),
        (tmp_path / "p.csv", ("--y-axis", "up"), False),
        (bare, (), False),
        (bare, ("--y-axis", "down"), True),
    ):
        result = run("points", "draw", file, "-o", tmp_path / "out", "--json", *words)
        assert result.exit_code == 0, result.output
        printed = json.loads(result.stdout)
        del printed["files"]
        pair = rotated_point_pair(xy, "p.csv", EASY_SEED, y_down=y_down)
        assert printed == json.loads(json.dumps(numbers_drawn(pair, choose_ring_pair(pair))))
        drawn = (tmp_path / "out" / NAMES[0]).read_text(encoding="utf-8")
        assert ("y down, as in images" in " ".join(drawn.split())) == y_down
    turned = saved(tmp_path / "q.csv", Similarity(1.0, 0.4).apply(xy))
    result = run("points", "draw", tmp_path / "p.csv", turned, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert "one file is a template, the other is not" in result.stderr
    words = ("-o", tmp_path / "out", "--json", "--y-axis", "down")
    result = run("points", "draw", tmp_path / "p.csv", turned, *words)
    rotation = json.loads(result.stdout)["rotation_deg"]["sets"]
    assert rotation == pytest.approx(-np.degrees(0.4))  # clockwise on screen


def rotated_ring(points):
    """Return a point with a closed ring, not the one that is drawn by default."""
    pair = rotated_point_pair(points, "points", 1)
    chosen = choose_ring_pair(pair).p.centre
    return next(i for i in pair.p.mesh.interior.nonzero()[0] if i != chosen)


def test_without_matplotlib_one_line_says_what_to_install(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = run("points", "draw", "-o", tmp_path / "out")
    assert_refused(result, "matplotlib")
    assert not (tmp_path / "out").exists()


def test_the_help_names_every_picture(run):
    text = run("points", "draw", "--help").stdout
    assert all(name.removesuffix(".svg") in text for name in NAMES)
