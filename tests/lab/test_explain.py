"""`fpmatch explain`: its numbers are the matchers' own, and it shows whatever there is."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fpmatch.formats.files import save_template
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.lab.cli.explain import write_page
from fpmatch.lab.explain.default import DefaultMethod, _ring_steps, explain_prints
from fpmatch.lab.explain.paper import PaperMethod, explain_points
from fpmatch.lab.points.match import match_points
from fpmatch.matching import reference
from fpmatch.matching.matchers.unit_circle import REFERENCE as MATCHER
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper.matcher import UnitCircleParameters
from fpmatch.pointset.paper.parametrize import parametrize
from fpmatch.prints.pair import PairOptions, compare_pair
from fpmatch.prints.reading import GivenPrint
from fpmatch.templates.minutiae import Minutiae, Template
from tests.conftest import assert_refused

pytest.importorskip("matplotlib", reason="the plot extra is not installed")

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
POINTS = np.random.default_rng(8).uniform(0.0, 100.0, (25, 2))
MOVE = Similarity(2.0, -1.2, 7.0, 9.0)
DEFAULT = (
    *("triangulation", "local_matches", "relaxation", "mesh_of_pairs", "unit_circle", "weights"),
    *("predictions", "ridges", "evidence", "transform"),
)
PAPER = "triangulation", "unit_circle", "weights", "similar_rings", "global_match"


@pytest.fixture(scope="module")
def prints():
    images = {name: read_image(SAMPLES / f"{name}.tif") for name in ("101_1", "101_3", "102_1")}
    return [GivenPrint(name, extract(image), image) for name, image in images.items()]


@pytest.fixture
def undrawn(monkeypatch):
    """Leave the pictures out, which take most of the time."""
    monkeypatch.setattr("fpmatch.lab.explain.pictures.draw", lambda *_: b"<svg/>")


def explained(probe, reference_):
    """Return the numbers of the steps on two prints, by step, and their comparison."""
    pair = compare_pair(probe, reference_, PairOptions())
    steps = explain_prints(DefaultMethod.of(probe, reference_), pair)
    return {step.name: step.numbers for step in steps}, pair


def given_minutiae(xy):
    """Return a print of minutiae at places, without an image, whose directions differ."""
    x, y = np.asarray(xy, np.float32).reshape(-1, 2).T
    return GivenPrint("made", Template(Minutiae(x, y, np.arange(len(x)) % 6), 300, 300))


def of_points(p, q):
    return PaperMethod.of_sets((("p.csv", p), ("q.csv", q)), UnitCircleParameters(), 0.6)


def text_of(folder):
    """Check the files of a page; return its text."""
    page = (folder / "index.html").read_text("utf-8")
    shown = re.findall(r'<img src="([^"]+)"', page)
    assert {path.name for path in folder.iterdir()} == {"index.html", "numbers.json", *shown}
    assert "http" not in page
    for name in shown:
        assert ElementTree.parse(folder / name).getroot().tag.endswith("svg")
    text = " ".join(re.sub(r"<[^>]+>", "", page).split())
    assert not re.search(r"\bnan\b|\binf\b|\bNone\b", text)
    return text


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(("p", "q"), [(0, 1), (1, 0), (0, 2), (0, 0)])
def test_the_numbers_are_those_of_the_reference_matcher(prints, p, q):
    numbers, pair = explained(prints[p], prints[q])
    both = [MATCHER.prepare(prints[k].template) for k in (p, q)]
    first = numbers["predictions"]["first"]
    a, b = both[::-1] if first == "Q" else both
    pairing, evidence = reference.match(a, b)
    assert numbers["mesh_of_pairs"]["pairs"] == pair.verification.pairs.tolist()
    shown = numbers["evidence"]
    for name in evidence._fields:
        assert shown[name] == pytest.approx(getattr(evidence, name), abs=1e-9)
    assert shown["minus_log_fmr"] <= min(shown["by_sum"], shown["bound"]) + 1e-9
    bias = shown["total"] - sum(adds for *_, adds in shown["features"])
    assert bias == pytest.approx(reference.load_weights().model_of(a, b).bias)
    assert shown["reported"]["minus_log_fmr"] == pytest.approx(-np.log(pair.verification.fmr))
    place = pairing.mesh[1]
    at = np.column_stack([place.real, -place.imag]) / b.to_500dpi
    np.testing.assert_allclose(numbers["predictions"]["at"], at, atol=1e-6)
    assert numbers["mesh_of_pairs"]["same"] == (p == q)


@pytest.mark.usefixtures("undrawn")
def test_the_ring_is_mapped_as_equations_3_and_4_say_and_its_sums_are_the_evidence(prints):
    m = DefaultMethod.of(*prints[:2])
    which, every = int(m.swapped), []
    for k, ring in m.rings.items():
        every.append({step.name: step.numbers for step in _ring_steps(m, m.matched[0], k)})
        points = np.column_stack([ring.points[which].real, ring.points[which].imag])
        centre = np.array([ring.centres[which].real, ring.centres[which].imag])
        circle = parametrize(points, centre)
        np.testing.assert_allclose(ring.angles[which], circle.angles, atol=1e-12)
        assert every[-1]["unit_circle"]["pair"] == k + 1
        np.testing.assert_allclose(every[-1]["weights"]["weights"], circle.weights, atol=1e-12)
        assert every[-1]["weights"]["first"] == "PQ"[which]
    sums = [sum(one[step]["agreement"] for one in every) for step in ("unit_circle", "weights")]
    evidence = m.matched[1]
    assert sums == pytest.approx([evidence.places, evidence.weights])


@pytest.mark.usefixtures("undrawn")
def test_frame_points_are_not_counted_in_the_difference_of_the_places(prints):
    m = DefaultMethod.of(prints[0], prints[2])
    k = next(k for k, ring in m.rings.items() if not ring.paired.all())
    circle = _ring_steps(m, m.matched[0], k)[0].numbers
    apart = [point["apart"] for point in circle["points"] if point["p"] != "frame"]
    assert circle["frame_points"] == len(circle["points"]) - len(apart) > 0
    assert circle["spread"] == pytest.approx(np.std(apart) if apart else 0.0)


def test_the_numbers_of_point_sets_are_those_of_the_papers_matcher():
    p, q = POINTS[3:], MOVE.apply(POINTS)
    steps = {step.name: step.numbers for step in explain_points(of_points(p, q))}
    assert tuple(steps) == PAPER
    oracle = match_points(p, q, matcher="paper")
    shown = steps["global_match"]
    assert (shown["match"], shown["pairs"]) == (True, oracle.pairs.tolist())
    assert shown["rotation_deg"] == pytest.approx(oracle.transform.rotation_deg)
    assert len(steps["similar_rings"]["matches"]) == oracle.local_matches
    ring = steps["unit_circle"]
    i = ring["centre"][0]
    circle = parametrize(p[[int(point["p"]) for point in ring["points"]]], p[i])
    np.testing.assert_allclose(steps["weights"]["weights"], circle.weights, atol=1e-9)
    assert ring["areas"][0] == pytest.approx(circle.area)
    places = [point["place_p"] for point in ring["points"]]
    turned = np.degrees(circle.angles) + ring["turn"]
    np.testing.assert_allclose((places - turned + 180) % 360, 180, atol=1e-9)


def test_a_match_a_non_match_a_changed_parameter_and_points_have_their_pages(run, tmp_path):
    one, other, third = (SAMPLES / f"{name}.tif" for name in ("101_1", "101_3", "102_1"))
    out = tmp_path / "new" / "out"
    done = run("explain", one, other, "-o", out)
    assert (done.exit_code, done.stdout) == (0, f"MATCH, 10 steps: {out / 'index.html'}\n")
    numbers = json.loads((out / "numbers.json").read_text())
    assert tuple(numbers) == ("matcher", "result", *(name for name in DEFAULT if name != "ridges"))
    assert "reported score; 40.0 is needed" in text_of(out)
    assert run("explain", one, third, "-o", out).exit_code == 0
    text = text_of(out)
    assert "The prints do not match: " in text
    assert "Most against one finger: " in text
    done = run("explain", one, other, "-o", out, "--matcher", "unit-circle:rounds=1")
    assert (done.exit_code, done.stdout.split(",")[0]) == (0, "NO SCORE")
    assert "no score: these parameters have no calibration" in text_of(out)
    assert run("explain", one, other, "-o", out, "--matcher", "paper").exit_code == 0
    assert "By the paper's rule" in text_of(out)
    for name, points in (("p", POINTS), ("q", MOVE.apply(POINTS))):
        np.savetxt(tmp_path / f"{name}.csv", points, delimiter=",")
    done = run("explain", tmp_path / "p.csv", tmp_path / "q.csv", "-o", out)
    assert (done.exit_code, done.stdout.split(",")[0]) == (0, "MATCH")
    assert "Pairs: 25, 100.0% of the smaller set; Transform: " in text_of(out)


@pytest.mark.usefixtures("undrawn")
def test_the_sides_of_the_equations_follow_the_order_of_the_prints(prints, tmp_path):
    for k, pair in enumerate((prints[:2], prints[1::-1])):
        steps = explain_prints(DefaultMethod.of(*pair), None)
        write_page(tmp_path / str(k), "title", ("verdict", [], steps, {}))
        first = next(step for step in steps if step.name == "weights").numbers["first"].lower()
        other = "p" if first == "q" else "q"
        text = text_of(tmp_path / str(k))
        assert f"{first} = Σk λk {first}k" in text
        assert f"{first} ↦ Σk λk {other}k" in text


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("p.csv q.csv --matcher unit-circle", "--matcher paper"),
        ("p.csv two.json", "p.csv and two.json: one has points, the other is a print"),
        ("two.json two.json --matcher reference", "only unit-circle and paper"),
        (
            "p.csv text.txt",
            "text.txt: line 1: expected a header with columns x and y or two numbers",
        ),
        ("p.csv huge.csv", "huge.csv: 1001 points"),
        ("p.csv q.csv --matcher paper:rho=2", "rho"),
        ("gone.tif two.json", "gone.tif: no such file"),
        ("p.csv q.csv -o .", "holds another file, "),
        ("p.csv q.csv -o p.csv", "p.csv/index.html: cannot be written"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(run, tmp_path, monkeypatch, words, reason):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(3)
    tables = {"p": POINTS, "q": MOVE.apply(POINTS), "huge": rng.uniform(0, 1, (1001, 2))}
    for name, points in tables.items():
        np.savetxt(f"{name}.csv", points, delimiter=",", header="x,y", comments="")
    Path("text.txt").write_text("neither a print nor points\n")
    save_template("two.json", given_minutiae([(10, 20), (90, 60)]).template)
    before = sorted(tmp_path.iterdir())
    assert_refused(run("explain", "-o", "out", *words.split()), reason)
    assert sorted(tmp_path.iterdir()) == before


SMALL = st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6)), max_size=9)


@given(p=SMALL, q=SMALL)
@settings(max_examples=5)
def test_whatever_minutiae_there_are_are_explained(p, q, tmp_path_factory):
    pair = [given_minutiae(np.multiply(xy, 40)) for xy in (p, q)]
    folder = tmp_path_factory.mktemp("page")
    write_page(folder, "", ("", [], explain_prints(DefaultMethod.of(*pair), None), {}))
    text_of(folder)


@given(p=SMALL.filter(len), q=SMALL.filter(len), power=st.sampled_from([-280, -20, 0, 20, 280]))
@settings(max_examples=5)
def test_whatever_points_there_are_are_explained(p, q, power, tmp_path_factory):
    m = of_points(np.ldexp(np.array(p, np.float64), power), np.array(q, np.float64))
    folder = tmp_path_factory.mktemp("page")
    write_page(folder, "", ("", [], explain_points(m), {}))
    text_of(folder)
