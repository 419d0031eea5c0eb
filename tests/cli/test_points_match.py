"""`fpmatch points match`: the transform it prints, its files, and what it says of bad input."""

from __future__ import annotations

import csv
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from fpmatch.cli.group import fpmatch as main
from fpmatch.pointset.match import POINT_MATCHERS
from fpmatch.pointset.similarity import Similarity

from .conftest import assert_refused

MOVE = Similarity(1.7, math.radians(-130), 250.0, -40.0)
KEYS = [
    "match",
    "transform",
    "pairs",
    "matched_share",
    "rms",
    "chance",
    "local_matches",
    "reason",
    "points",
    "matcher",
    "tolerance",
    "rho",
    "area_tolerance",
    "p",
    "q",
]


def write(path: Path, points: NDArray[np.float64], delimiter: str = ",") -> Path:
    lines = (f"{x!r}{delimiter}{y!r}\n" for x, y in points.tolist())
    path.write_text(f"x{delimiter}y\n{''.join(lines)}")
    return path


@pytest.fixture
def stars(tmp_path: Path, rng: np.random.Generator) -> tuple[Path, Path]:
    """Return two files: 30 points, and 28 of them moved, in another order, with 4 strangers."""
    p = rng.uniform(0, 100, (30, 2))
    q = np.vstack([MOVE.apply(p[2:]), MOVE.apply(rng.uniform(0, 100, (4, 2)))])[::-1]
    return write(tmp_path / "stars.csv", p), write(tmp_path / "catalogue.csv", q, ";")


@pytest.fixture
def unlike(tmp_path: Path, rng: np.random.Generator) -> tuple[Path, Path]:
    """Return two files of points that have nothing in common."""
    p, q = rng.uniform(0, 100, (12, 2)), rng.uniform(0, 100, (12, 2))
    return write(tmp_path / "one.csv", p), write(tmp_path / "other.csv", q)


def found(result: Any) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(result.stdout)
    return document


@pytest.mark.parametrize("matcher", POINT_MATCHERS)
def test_a_known_transform_is_printed(run: Any, stars: Any, matcher: str) -> None:
    result = run("points", "match", *stars, "--matcher", matcher)
    document = found(result)
    assert result.exit_code == 0
    assert result.stderr == ""
    assert list(document) == KEYS
    assert document["match"] is True
    transform = document["transform"]
    assert list(transform) == ["scale", "rotation_deg", "tx", "ty", "matrix"]
    assert transform["scale"] == pytest.approx(1.7)
    assert transform["rotation_deg"] == pytest.approx(-130)
    assert (transform["tx"], transform["ty"]) == pytest.approx((250, -40))
    np.testing.assert_allclose(transform["matrix"], MOVE.matrix, atol=1e-6)
    assert document["pairs"] == [[i, 33 - i] for i in range(2, 30)]
    assert document["matched_share"] == pytest.approx(28 / 30)
    assert document["rms"] == pytest.approx(0, abs=1e-6)
    assert (document["chance"] is None) == (matcher != "triangles")
    assert document["points"] == {"p": 30, "q": 32}
    assert (document["matcher"], document["tolerance"]) == (matcher, None)
    assert (document["p"], document["q"]) == tuple(map(str, stars))


@pytest.mark.parametrize("matcher", ["triangles", "paper"])
def test_no_match_is_status_1_and_null(run: Any, unlike: Any, matcher: str) -> None:
    result = run("points", "match", *unlike, "--tolerance", "0.5", "--json", "--matcher", matcher)
    document = found(result)
    assert result.exit_code == 1
    assert list(document) == KEYS
    assert document["match"] is False
    assert document["transform"] is document["rms"] is document["chance"] is None
    assert document["pairs"] == []
    assert document["matched_share"] == 0
    assert document["tolerance"] == 0.5
    assert bool(document["reason"]) == (matcher == "paper")


def test_the_words_of_a_match(run: Any, stars: Any) -> None:
    result = run("points", "match", *stars, "--text")
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert lines[:4] == [
        "MATCH",
        f"  Points      30 in {stars[0]} and 32 in {stars[1]}",
        "  Pairs       28, 93.3% of the smaller set",
        "  Transform   scale 1.7, rotation 130.000° from y to x, shift +250, -40",
    ]
    assert [line.split()[0] for line in lines[4:]] == ["Residual", "Chance"]


def test_the_words_of_no_match(run: Any, unlike: Any) -> None:
    result = run("points", "match", *unlike, "--text")
    assert result.exit_code == 1
    first, *rest = result.stdout.splitlines()
    assert first == "NO MATCH"
    assert len(rest) == 1


@pytest.mark.parametrize(("rho", "status"), [("0.93", 0), ("0.94", 1)])
def test_the_papers_method_decides_by_rho(run: Any, stars: Any, rho: str, status: int) -> None:
    words = ["points", "match", *stars, "--matcher", "paper", "--rho", rho]
    result = run(*words)
    document = found(result)
    assert result.exit_code == status
    assert document["match"] is (status == 0)
    assert (document["transform"] is None) == (status == 1)
    assert document["rho"] == float(rho)
    assert bool(document["reason"]) == (status == 1)
    text = run(*words, "--text").stdout
    assert text.startswith("NO MATCH\n" if status else "MATCH\n")
    why = f"the best transform pairs 93.3% of the smaller set; a match needs more than {rho}"
    assert (why in text) == (status == 1)


def test_a_smaller_area_tolerance_follows_fewer_local_matches(run: Any, stars: Any) -> None:
    words = ["points", "match", *stars, "--matcher", "paper", "--area-tolerance"]
    few, many = (found(run(*words, area)) for area in ("0.001", "1"))
    assert few["match"] is many["match"] is True
    assert few["local_matches"] < many["local_matches"]
    assert few["area_tolerance"] == 0.001


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        *((["--matcher", "paper", "--rho", rho], "rho must") for rho in ("-0.1", "1.1", "nan")),
        (["--matcher", "van-wamelen", "--rho", "1.1"], "rho must"),
        *(
            (["--matcher", "paper", "--area-tolerance", area], "area tolerance must")
            for area in ("0", "-1", "nan")
        ),
        (["--rho", "0.5"], "rho is a parameter of"),
        (["--area-tolerance", "1"], "area tolerance is a parameter of"),
        (["--tolerance", "-1"], "-1"),
    ],
)
def test_bad_parameters_are_one_line(run: Any, stars: Any, words: list[str], reason: str) -> None:
    assert_refused(run("points", "match", *stars, *words), reason)


def test_pairs_are_written_as_a_table(run: Any, stars: Any, tmp_path: Path) -> None:
    result = run("points", "match", *stars, "--pairs", tmp_path / "pairs.csv")
    with (tmp_path / "pairs.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [[int(row["p"]), int(row["q"])] for row in rows] == found(result)["pairs"]
    for row in rows:
        moved = MOVE.apply([[float(row["p_x"]), float(row["p_y"])]])[0]
        assert moved == pytest.approx((float(row["q_x"]), float(row["q_y"])))
        assert float(row["distance"]) == pytest.approx(0, abs=1e-6)


def test_without_a_match_the_table_is_empty(run: Any, unlike: Any, tmp_path: Path) -> None:
    assert run("points", "match", *unlike, "--pairs", tmp_path / "pairs.csv").exit_code == 1
    assert (tmp_path / "pairs.csv").read_text() == "p,q,p_x,p_y,q_x,q_y,distance\n"


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_a_plot_is_drawn_whatever_the_decision(
    run: Any, stars: Any, unlike: Any, tmp_path: Path, suffix: str
) -> None:
    pytest.importorskip("matplotlib", reason="the plot extra is not installed")
    for files, status in ((stars, 0), (unlike, 1)):
        path = tmp_path / f"plot{status}.{suffix}"
        result = run("points", "match", *files, "--plot", path)
        assert result.exit_code == status
        assert found(result)["match"] is (status == 0)
        assert path.stat().st_size > 5000


def test_a_dash_reads_standard_input(stars: Any) -> None:
    p, q = stars
    for words, document in (
        (["-", str(q)], p.read_bytes()),
        ([str(p), "-"], q.read_bytes()),
    ):
        result = CliRunner().invoke(main, ["points", "match", *words], input=document)
        assert found(result)["match"] is True
        assert [found(result)["p"], found(result)["q"]] == words


def test_standard_input_is_named_in_errors(run: Any, stars: Any, monkeypatch: Any) -> None:
    words = ["points", "match", str(stars[0]), "-"]
    result = CliRunner().invoke(main, words, input=b"1,2\n3,a\n")
    assert_refused(result, "standard input, line 2: ")
    both = run("points", "match", "-", "-")
    assert both.exit_code == 2
    assert "only one of the sets can come from standard input" in both.stderr


def test_repeated_points_are_noted_once(run: Any, stars: Any) -> None:
    p, q = stars
    first, second, third, *rest = p.read_text().splitlines()
    p.write_text("\n".join([first, second, third, *rest, third, third, rest[5]]))
    result = run("points", "match", p, q)
    assert result.exit_code == 0
    assert result.stderr == f"fpmatch: note: {p}: points that repeat another: 3\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1,2\n3,4\n", ": too few points: 2 of at least 3"),
        ("0,0\n0.1,0.3\n0.2,0.6\n0.7,2.1\n", ": all points lie on one line"),
        ("1e300,0\n0,1e300\n-1e300,2e300\n", ": all points lie on one line"),
        ("1,2\n3,4\nx,6\n", ", line 3: expected a number for x, not 'x'"),
        ("", ": the file is empty"),
    ],
)
def test_bad_sets_are_one_line(
    run: Any, stars: Any, tmp_path: Path, text: str, reason: str
) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text(text)
    for files in ((bad, stars[1]), (stars[0], bad)):
        result = run("points", "match", *files, "--pairs", tmp_path / "pairs.csv")
        assert_refused(result, f"{bad}{reason}")
    assert not (tmp_path / "pairs.csv").exists()


def test_files_that_are_not_there(run: Any, stars: Any, tmp_path: Path) -> None:
    gone = tmp_path / "gone.csv"
    assert_refused(run("points", "match", gone, stars[1]), f"{gone}: no such file")
    assert_refused(run("points", "match", stars[0], tmp_path), f"{tmp_path}: is a folder")


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--plot", "plot.pdf"], "plot.pdf: a plot is written as .png or .svg"),
        (["--pairs", "no/such/pairs.csv"], "no/such/pairs.csv: cannot be written"),
        (["--pairs", "."], ".: cannot be written: it is a folder"),
    ],
)
def test_bad_outputs_are_refused_before_anything_is_read(
    run: Any, words: list[str], reason: str
) -> None:
    assert_refused(run("points", "match", "gone.csv", "gone.csv", *words), reason)


def test_without_matplotlib_there_is_no_plot(
    run: Any, stars: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert_refused(run("points", "match", *stars, "--plot", tmp_path / "plot.png"), "matplotlib")
    assert run("points", "match", *stars).exit_code == 0


@pytest.mark.parametrize("words", [[], ["p.csv"], ["p.csv", "q.csv", "--matcher", "best"]])
def test_wrong_usage(run: Any, words: list[str]) -> None:
    result = run("points", "match", *words)
    assert result.exit_code == 2
    assert "Usage: fpmatch points match" in result.stderr


def test_help_names_the_matchers_and_has_examples(run: Any) -> None:
    output = run("points", "match", "--help").output
    assert f"[{'|'.join(POINT_MATCHERS)}]" in output
    assert "  fpmatch points match stars.csv catalogue.csv\n" in output
    for key in KEYS:
        assert f" {key}" in output.split("JSON:")[1]
