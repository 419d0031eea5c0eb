import json
import math

import numpy as np
import pytest

from fpmatch.lab.points.match import POINT_MATCHERS
from fpmatch.pointset.geometry.similarity import Similarity
from tests.conftest import rows_of

MOVE = Similarity(1.7, math.radians(-130), 250.0, -40.0)
KEYS = [
    "match", "transform", "pairs", "matched_share", "rms", "chance", "local_matches", "reason",
    "equal_maps", "points", "matcher", "tolerance", "rho", "reflect", "p", "q",
]  # fmt: skip


def write(path, points, delimiter=","):
    rows = (f"{x!r}{delimiter}{y!r}{delimiter}star{k}" for k, (x, y) in enumerate(points.tolist()))
    path.write_text("\n".join([delimiter.join(["x", "y", "name"]), *rows, ""]))
    return path


@pytest.fixture
def stars(tmp_path, rng):
    """Return two files: 30 points, and 28 of them moved, in another order, with 4 others."""
    p = rng.uniform(0, 100, (30, 2))
    q = np.vstack([MOVE.apply(p[2:]), MOVE.apply(rng.uniform(0, 100, (4, 2)))])[::-1]
    return write(tmp_path / "stars.csv", p), write(tmp_path / "catalogue.csv", q, "\t")


@pytest.fixture
def unlike(tmp_path, rng):
    """Return two files of points that have nothing in common."""
    p, q = rng.uniform(0, 100, (12, 2)), rng.uniform(0, 100, (12, 2))
    return write(tmp_path / "one.csv", p), write(tmp_path / "other.csv", q)


@pytest.fixture
def match(run):
    """Return a function that runs the command and returns its result and its JSON."""

    def run_match(*words, **options):
        result = run("points", *words, "--json", **options)
        return result, json.loads(result.stdout)

    return run_match


@pytest.mark.parametrize("matcher", POINT_MATCHERS)
def test_a_known_transform_is_printed(match, stars, matcher):
    result, document = match(*stars, "--matcher", matcher)
    assert (result.exit_code, result.stderr) == (0, "")
    assert list(document) == KEYS
    assert document["match"] is True
    transform = document["transform"]
    assert list(transform) == ["scale", "rotation_deg", "tx", "ty", "mirrored", "matrix"]
    assert transform["mirrored"] is document["reflect"] is False
    assert list(transform.values())[:4] == pytest.approx([1.7, -130, 250, -40])
    np.testing.assert_allclose(transform["matrix"], MOVE.matrix, atol=1e-6)
    assert document["pairs"] == [[i, 33 - i] for i in range(2, 30)]
    assert document["matched_share"] == pytest.approx(28 / 30)
    assert document["rms"] == pytest.approx(0, abs=1e-6)
    assert (document["chance"] is None) == (matcher != "triangles")
    assert document["points"] == {"p": 30, "q": 32}
    assert (document["matcher"], document["tolerance"]) == (matcher, None)
    assert (document["p"], document["q"]) == tuple(map(str, stars))


@pytest.mark.parametrize("matcher", POINT_MATCHERS)
def test_no_match_is_status_1_and_null(match, unlike, tmp_path, matcher):
    words = ("--tolerance", "0.5", "--json", "--matcher", matcher)
    result, document = match(*unlike, *words, "--pairs", tmp_path / "pairs.csv")
    assert result.exit_code == 1
    assert list(document) == KEYS
    assert document["match"] is False
    assert document["transform"] is document["rms"] is document["chance"] is None
    assert (document["pairs"], document["matched_share"], document["tolerance"]) == ([], 0, 0.5)
    assert document["reason"]
    assert (tmp_path / "pairs.csv").read_text() == "p,q,p_x,p_y,q_x,q_y,distance,p_name,q_name\n"


@pytest.mark.parametrize(("rho", "status"), [("0.93", 0), ("0.94", 1)])
def test_the_papers_method_decides_by_rho(match, stars, rho, status):
    result, document = match(*stars, "--matcher", f"paper:rho={rho}")
    assert (result.exit_code, document["match"]) == (status, status == 0)
    assert (document["transform"] is None) == bool(document["reason"]) == (status == 1)
    assert document["rho"] == float(rho)
    assert ("93.3%" in document["reason"]) == (rho in document["reason"]) == (status == 1)


@pytest.mark.parametrize("matcher", POINT_MATCHERS)
def test_a_mirrored_set_matches_on_request(match, run, tmp_path, rng, matcher):
    truth = Similarity(1.7, math.radians(40), 250, -40, mirrored=True)
    p = rng.uniform(0, 100, (30, 2))
    q = np.vstack([truth.apply(p[2:]), truth.apply(rng.uniform(0, 100, (4, 2)))])
    files = write(tmp_path / "oblique.csv", p), write(tmp_path / "map.csv", q)
    words = (*files, "--matcher", matcher)
    assert match(*words)[1]["match"] is False
    result, document = match(*words, "--reflect")
    assert result.exit_code == 0
    assert list(document) == KEYS
    transform = document["transform"]
    assert list(transform) == ["scale", "rotation_deg", "tx", "ty", "mirrored", "matrix"]
    assert list(transform.values())[:4] == pytest.approx([1.7, 40, 250, -40])
    assert transform["mirrored"] is document["reflect"] is True
    np.testing.assert_allclose(transform["matrix"], truth.matrix, atol=1e-6)
    assert " mirrored (" in run("points", *words, "--reflect").stdout


def test_pairs_are_written_as_a_table(match, stars, tmp_path):
    _, document = match(*stars, "--pairs", tmp_path / "pairs.csv")
    rows = rows_of(tmp_path / "pairs.csv")
    assert [[int(row["p"]), int(row["q"])] for row in rows] == document["pairs"]
    for row in rows:
        moved = MOVE.apply([[float(row["p_x"]), float(row["p_y"])]])[0]
        assert moved == pytest.approx((float(row["q_x"]), float(row["q_y"])))
        assert float(row["distance"]) == pytest.approx(0, abs=1e-6)
        assert (row["p_name"], row["q_name"]) == (f"star{row['p']}", f"star{row['q']}")


def test_a_plot_is_drawn_whatever_the_decision(match, stars, unlike, tmp_path):
    pytest.importorskip("matplotlib", reason="the plot extra is not installed")
    for files, name in ((stars, "match.png"), (unlike, "none.pdf")):
        assert match(*files, "--plot", tmp_path / name)[0].exit_code == (files is unlike)
        assert (tmp_path / name).stat().st_size > 5000
