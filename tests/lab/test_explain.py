"""`fpmatch explain`: its numbers are the matchers' own, and it shows whatever there is."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import FpmatchError
from fpmatch.formats.files import save_template
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.lab.explain import default_steps, paper_steps
from fpmatch.lab.explain.default import DefaultMethod
from fpmatch.lab.explain.paper import PaperMethod
from fpmatch.lab.points.match import match_points
from fpmatch.matching import reference
from fpmatch.matching.matchers.reference import MATCHER
from fpmatch.matching.parameters import USUAL
from fpmatch.matching.reference.neighbourhood import local_similarity
from fpmatch.matching.verify import verify
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper.matcher import UnitCircleParameters
from fpmatch.pointset.paper.parametrize import parametrize
from fpmatch.prints.pair import PairOptions, compare_pair
from fpmatch.prints.reading import GivenPrint
from fpmatch.templates.minutiae import Minutiae, Template
from tests.conftest import assert_refused

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
POINTS = np.random.default_rng(8).uniform(0.0, 100.0, (25, 2))
MOVE = Similarity(2.0, -1.2, 7.0, 9.0)
DEFAULT = (
    *("points", "triangulation", "neighbours", "local_matches", "relaxation", "mesh_of_pairs"),
    *("unit_circle", "weights", "predictions", "ridges", "evidence", "transform"),
)
PAPER = "points", "triangulation", "unit_circle", "weights", "local_matches", "global_match"


@pytest.fixture(scope="module")
def prints():
    images = {name: read_image(SAMPLES / f"{name}.tif") for name in ("101_1", "101_3", "102_1")}
    return [GivenPrint(name, extract(image), image) for name, image in images.items()]


def compared(probe, reference, **options):
    return compare_pair(probe, reference, PairOptions(**options))


def given_minutiae(xy):
    """Return a print of minutiae at places, without an image, whose directions differ."""
    x, y = np.asarray(xy, np.float32).reshape(-1, 2).T
    return GivenPrint("made", Template(Minutiae(x, y, np.arange(len(x)) % 6), 300, 300))


def of_points(p, q):
    return PaperMethod.of_sets([("p.csv", p), ("q.csv", q)], UnitCircleParameters(), 0.6)


def check(steps, numbers):
    """Check that every step says something, its picture is SVG, and the numbers are JSON."""
    json.dumps(numbers, allow_nan=False)
    assert len({step.name for step in steps}) == len(steps)
    for step in steps:
        assert step.sentence.endswith(".")
        assert not re.search(r"\bnan\b|\binf\b", step.sentence)


@pytest.mark.parametrize(("p", "q"), [(0, 1), (1, 0), (0, 2), (0, 0)])
def test_the_numbers_are_those_of_the_reference_matcher(prints, p, q):
    pair = compared(prints[p], prints[q])
    steps, numbers = default_steps.explain_prints(pair, USUAL, None)
    check(steps, numbers)
    oracle = verify(prints[p].template, prints[q].template, matcher="reference")
    both = [MATCHER.prepare(prints[k].template) for k in (p, q)]
    swapped = numbers["first"] == "q"
    first, second = both[::-1] if swapped else both
    pairing, (*_, evidence) = reference.match(first, second)
    pairs = [[row["p"], row["q"]] for row in numbers["pairs"]]
    assert pairs == oracle.pairs.tolist() == pair.verification.pairs.tolist()
    for name in ("pairs", "relaxed", "places", "weights", "total", "minus_log_fmr"):
        assert numbers["evidence"][name] == pytest.approx(getattr(evidence, name), abs=1e-9)
    similarity = local_similarity(first.neighbourhoods, second.neighbourhoods)
    own = np.transpose(numbers["similarity"]) if swapped else numbers["similarity"]
    np.testing.assert_allclose(own, similarity, atol=1e-6)
    predicted = [prediction["at"] for prediction in numbers["predictions"]]
    place = pairing.mesh[1]
    given_ = np.column_stack([place.real, -place.imag]) / second.to_500dpi
    np.testing.assert_allclose(predicted, given_, atol=1e-6)
    t = pair.verification.transform
    assert numbers["ring"] is not None
    assert (t is None) == (oracle.transform is None)


def test_the_ring_is_mapped_as_equations_3_and_4_say(prints):
    m = DefaultMethod.of(compared(prints[0], prints[1]))
    for chosen, ring in enumerate(m.rings):
        numbers = m.numbers(chosen)["ring"]
        a = int(m.swapped)
        points = [np.column_stack([of.real, of.imag]) for of in ring.points]
        centre = np.array([ring.centres[a].real, ring.centres[a].imag])
        circle = parametrize(points[a], centre)
        np.testing.assert_allclose(numbers["weights"], circle.weights, atol=1e-12)
        np.testing.assert_allclose(ring.angles[a], circle.angles, atol=1e-12)
        assert numbers["pair"] == chosen + 1
        assert circle.weights @ points[a] == pytest.approx(centre)


def test_the_sums_over_the_rings_are_the_evidence(prints):
    m = DefaultMethod.of(compared(prints[0], prints[1]))
    measures = [m.measures(m.matched, k) for k in range(len(m.rings))]
    evidence = m.matched.evidence
    assert sum(of.place_agreement for of in measures) == pytest.approx(evidence.places)
    assert sum(of.weight_agreement for of in measures) == pytest.approx(evidence.weights)


def test_the_neighbours_that_count_make_the_similarity(prints):
    least = MATCHER.parameters.neighbour_cosine
    ours, theirs = (MATCHER.prepare(of.template).neighbourhoods for of in prints[:2])
    similarity = local_similarity(ours, theirs)
    for i, j in np.argwhere(similarity >= 0)[::97]:
        frames = [of.frame[k, :, : of.count[k]] for of, k in ((ours, i), (theirs, j))]
        assert bool(default_steps.counterparts(*frames, least)) == bool(similarity[i, j] > 0)


def test_the_numbers_of_point_sets_are_those_of_the_papers_matcher():
    m = of_points(POINTS[3:], MOVE.apply(POINTS))
    steps, numbers = paper_steps.explain_points(m, None)
    check(steps, numbers)
    assert tuple(step.name for step in steps) == PAPER
    oracle = match_points(POINTS[3:], MOVE.apply(POINTS), matcher="paper")
    assert [[row["p"], row["q"]] for row in numbers["pairs"]] == oracle.pairs.tolist()
    assert len(numbers["local_matches"]) == oracle.local_matches
    assert numbers["match"] is True
    assert numbers["transform"]["rotation_deg"] == pytest.approx(oracle.transform.rotation_deg)
    ring = numbers["ring"]
    circle = parametrize(ring["p"]["points"], ring["p"]["centre"])
    np.testing.assert_allclose(ring["weights"], circle.weights, atol=1e-9)
    np.testing.assert_allclose(ring["p"]["angles_deg"], np.degrees(circle.angles), atol=1e-9)
    assert ring["areas"][0] == pytest.approx(circle.area)
    right = [row for row in numbers["local_matches"] if row["q"] == row["p"] + 3]
    assert right
    for row in right:
        assert row["scale"] == pytest.approx(2.0, rel=1e-6) or row["areas"][0] != row["areas"][1]


def pictures_of(folder):
    """Check page and pictures of a folder; return the names of the steps with a picture."""
    page = (folder / "index.html").read_text("utf-8")
    shown = re.findall(r'<img src="([^"]+)"', page)
    files = {path.name for path in folder.iterdir()}
    assert files == {"index.html", "numbers.json", *shown}
    assert page.count("<h2>") >= len(shown)
    assert "http" not in page
    for name in shown:
        root = ElementTree.parse(folder / name).getroot()
        assert root.tag.endswith("svg")
        assert len(list(root.iter())) > 10
    return [name[3:-4] for name in shown]


def test_each_kind_of_page_has_its_pictures(run, tmp_path):
    pair = [SAMPLES / f"{name}.tif" for name in ("101_1", "101_3")]
    out = tmp_path / "new" / "out"
    done = run("explain", *pair, "-o", out)
    assert (done.exit_code, done.stdout) == (0, f"MATCH, 12 steps: {out / 'index.html'}\n")
    assert tuple(pictures_of(out)) == tuple(name for name in DEFAULT if name != "evidence")
    numbers = json.loads((out / "numbers.json").read_text())
    assert numbers["result"]["pairs"] == len(numbers["pairs"])
    done = run("explain", *pair, "-o", out, "--matcher", "paper", "--pair", 8)
    assert done.exit_code == 0, done.stderr
    assert tuple(pictures_of(out)) == (*PAPER, "transform")
    assert json.loads((out / "numbers.json").read_text())["ring"]["pair"] == 8
    for name, points in (("p", POINTS), ("q", MOVE.apply(POINTS))):
        np.save(tmp_path / f"{name}.npy", points)
    done = run("explain", tmp_path / "p.npy", tmp_path / "q.npy", "-o", out)
    assert done.exit_code == 0, done.stderr
    assert tuple(pictures_of(out)) == PAPER


def test_prints_that_do_not_match_and_one_print_twice_are_explained(prints):
    steps, numbers = default_steps.explain_prints(compared(prints[0], prints[2]), USUAL, None)
    assert "do not match" in steps[-1].sentence
    assert len(numbers["pairs"]) < 8
    steps, numbers = default_steps.explain_prints(compared(prints[0], prints[0]), USUAL, None)
    assert all(row["p"] == row["q"] for row in numbers["pairs"])
    assert {row["similarity"] > 0.9 for row in numbers["local_matches"]} >= {True}


def test_two_minutiae_are_explained(run, tmp_path):
    save_template(tmp_path / "two.json", given_minutiae([(10, 20), (90, 60)]).template)
    for words in ((), ("--matcher", "paper")):
        done = run("explain", *[tmp_path / "two.json"] * 2, "-o", tmp_path / "out", *words)
        assert done.exit_code == 0, done.stderr
        assert pictures_of(tmp_path / "out")[:2] == ["points", "triangulation"]


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("p.csv q.csv --pair 99", "--pair 99: pairs are numbered 1 to 25"),
        ("p.csv q.csv --pair 0", "--pair 0: "),
        ("p.csv line.csv --pair 1", "--pair 1: there is no pair"),
        ("p.csv q.csv --matcher unit-circle", "--matcher paper"),
        ("p.csv two.json", "p.csv: points, which cannot be compared with the print two.json"),
        ("two.json p.csv", "p.csv: points, which cannot be compared with the print two.json"),
        ("two.json two.json --matcher triangles", "only unit-circle and paper"),
        ("p.csv text.txt", "text.txt: not an image, a template or a table of points (line 1: "),
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
    for name, points in {**tables, "line": [[0, 0], [1, 1], [2, 2]]}.items():
        np.savetxt(f"{name}.csv", points, delimiter=",", header="x,y", comments="")
    Path("text.txt").write_text("neither a print nor points\n")
    save_template("two.json", given_minutiae([(10, 20), (90, 60)]).template)
    before = sorted(tmp_path.iterdir())
    assert_refused(run("explain", "-o", "out", *words.split()), reason)
    assert sorted(tmp_path.iterdir()) == before


SMALL = st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6)), max_size=9)


@given(p=SMALL, q=SMALL)
def test_whatever_minutiae_there_are_are_explained(p, q):
    pair = compared(*(given_minutiae(np.multiply(xy, 40)) for xy in (p, q)))
    check(*default_steps.explain_prints(pair, USUAL, None))


@given(p=SMALL.filter(len), q=SMALL.filter(len), power=st.sampled_from([-280, -60, 0, 60, 280]))
def test_whatever_points_there_are_are_explained(p, q, power):
    m = of_points(np.ldexp(np.array(p, np.float64), power), np.array(q, np.float64))
    check(*paper_steps.explain_points(m, None))
    for k, ring in enumerate(m.rings, start=1):
        if ring is None:
            with pytest.raises(FpmatchError, match=f"--pair {k}: it has no ring"):
                paper_steps.explain_points(m, k)
        else:
            assert paper_steps.explain_points(m, k)[1]["ring"]["pair"] == k
