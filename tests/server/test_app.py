"""The HTTP API: it answers as the commands do, and bad input is one sentence with its status."""

import io
import json
import re
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch.formats.files import load_template
from fpmatch.gallery.gallery import open_gallery
from fpmatch.image.skeleton._thin_kernel import COMPILED
from fpmatch.matching.constants.comparison import IMPOSTOR_RIDGES
from fpmatch.prints.reading import ASSUMED_DPI
from fpmatch.server.settings import STATIC, Limits

from .conftest import png, served_gallery, serving


def sent(prints, **names):
    return {field: (name, prints[name]) for field, name in names.items()}


@pytest.mark.parametrize(
    ("reference", "options", "match"),
    [
        ("1_2.png", {}, True),
        ("2_1.png", {}, False),
        ("1_2.png", {"fmr": 0.01, "probe_dpi": 450, "dpi": 500, "matcher": "paper"}, True),
        ("1_2.png", {"matcher": "paper:rho=0.05,area_tolerance=0.2"}, True),
    ],
)
def test_verify_answers_as_the_command_does(
    run, client, prints, tmp_path, monkeypatch, reference, options, match
):
    files = sent(prints, probe="1_1.png", reference=reference)
    answer = client.post("/verify", files=files, data=options)
    assert answer.status_code == 200
    words = [f"--{name.replace('_', '-')}={value}" for name, value in options.items()]
    monkeypatch.chdir(tmp_path)
    for name in ("1_1.png", reference):
        Path(name).write_bytes(prints[name])
    printed = json.loads(run("verify", "1_1.png", reference, "--json", *words).stdout)
    assert answer.json() == printed
    assert printed["match"] == match


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"fmr": "5"}, "a false match rate lies"),
        ({"threshold": "101"}, "threshold must lie in"),
        ({"threshold": "40", "fmr": "0.1"}, "fmr and threshold exclude each other"),
        ({"dpi": "7"}, "dpi"),
        ({"dpi": "many"}, "dpi: input should be a valid number"),
        ({"matcher": "nobody"}, "matcher"),
        ({"matcher": "antigravity:fly"}, "unknown matcher 'antigravity:fly'; known: paper, "),
        ({"matcher": "unit-circl"}, "unit-circle. Did you mean 'unit-circle'?"),
        ({"enhance": "magic"}, "enhance: input should be"),
        ({"matcher": "paper:rho=2"}, "rho lies from 0 to 1, not 2"),
        ({"matcher": "unit-circle:rho=0.5"}, "matcher unit-circle has no parameter 'rho'"),
        ({"matcher": "antigravity:fly:rho=0.5"}, "unknown matcher 'antigravity:fly'; known: paper"),
        ({"matcher": "paper:rho=0.5", "threshold": 30}, "rho decides without a score"),
    ],
)
def test_a_bad_option_is_one_sentence(client, prints, options, reason):
    files = sent(prints, probe="1_1.png", reference="1_2.png")
    answer = client.post("/verify", files=files, data=options)
    assert answer.status_code == 422
    assert list(answer.json()) == ["error"]
    assert reason in answer.json()["error"]


def test_extract_returns_the_template_that_the_command_writes(run, client, prints, tmp_path):
    files = sent(prints, image="1_1.png")
    answer = client.post("/extract", files=files)
    (tmp_path / "sent.json").write_bytes(answer.content)
    (tmp_path / "1_1.png").write_bytes(prints["1_1.png"])
    assert run("extract", tmp_path / "1_1.png", "-o", tmp_path / "out").exit_code == 0
    assert load_template(tmp_path / "sent.json") == load_template(tmp_path / "out" / "1_1.json")
    pair = {"probe": ("1_1.json", answer.content), "reference": ("1.png", prints["1_1.png"])}
    again = client.post("/compare", files=pair).json()
    assert again["result"]["score"] > 40
    assert again["probe"]["kind"] == "template"
    assert again["probe"]["ink"].startswith("data:image/png;base64,")  # it contains ridges
    other = client.post("/extract", files=files, data={"format": "iso2005"})
    assert other.content.startswith(b"FMR\0")
    assert "template.iso" in other.headers["content-disposition"]
    pair["probe"] = ("1_1.iso", other.content)
    of_minutiae = client.post("/compare", files=pair).json()["probe"]
    assert (of_minutiae["kind"], of_minutiae["ink"]) == ("template", None)
    left, top, right, bottom = of_minutiae["extent"]
    x, y, *_ = zip(*of_minutiae["minutiae"], strict=True)
    assert [left, right] == [round(min(x)), round(max(x))]
    assert [top, bottom] == [round(min(y)), round(max(y))]


def test_overlays_are_pictures(client, prints):
    files = sent(prints, probe="1_1.png", reference="1_2.png")
    picture = client.post("/overlay", files=files)
    assert picture.headers["content-type"] == "image/png"
    assert Image.open(io.BytesIO(picture.content)).size[0] >= 800
    drawing = client.post("/overlay", files=files, data={"format": "svg", "side_by_side": "true"})
    assert drawing.headers["content-type"] == "image/svg+xml"
    assert drawing.text.startswith("<svg")


def test_further_views_are_of_the_same_comparison(client, prints):
    files = sent(prints, probe="1_1.png", reference="1_2.png")
    shown = client.post("/compare", files=files).json()
    views = client.post("/views", files=files).json()
    ridges = views["ridges"]
    compared = shown["result"]["compared"]
    assert ridges["mean"] == pytest.approx(compared["ridge_agreement"], rel=1e-12)
    assert ridges["area_mm2"] == compared["ridge_area_mm2"]
    assert ridges["impostor_mean"] == IMPOSTOR_RIDGES
    assert {len(cell) for cell in ridges["cells"]} == {4}
    assert all(re.fullmatch("#[0-9a-f]{6}", cell[3]) for cell in ridges["cells"])
    both = client.post("/overlay", files=files, data={"side_by_side": "true", "ridges": "true"})
    assert both.status_code == 422
    assert "exclude" in both.json()["error"]


def test_prints_without_ridges_have_no_further_views(client, prints):
    files = sent(prints, probe="blank.png", reference="1_2.png")
    views = client.post("/views", files=files).json()
    assert views == {"ridges": None}


def test_compare_tells_all_that_the_page_shows(client, prints):
    files = sent(prints, probe="1_1.png", reference="1_2.png")
    shown = client.post("/compare", files=files).json()
    probe, reference = shown["probe"], shown["reference"]
    assert len(shown["pairs"]) == shown["result"]["pairs"] > 5
    assert (probe["width"], probe["height"]) == (280, 300)
    assert probe["picture"].startswith("data:image/webp;base64,")
    assert reference["ink"].startswith("data:image/png;base64,")
    most_i, most_j = map(max, zip(*shown["pairs"], strict=True))
    assert most_i < len(probe["minutiae"])
    assert most_j < len(reference["minutiae"])
    assert {"Minutiae", "Transform"} <= {row["label"] for row in shown["rows"]}


def test_an_unknown_resolution_and_a_blank_picture_are_said(client, prints):
    files = sent(prints, probe="untold.png", reference="blank.png")
    shown = client.post("/compare", files=files).json()
    assert shown["probe"]["notes"] == [ASSUMED_DPI]
    assert shown["reference"]["notes"] == []
    assert shown["result"]["match"] is False
    assert shown["result"]["transform"] is None
    assert shown["result"]["reason"]
    assert shown["reference"]["extent"] == [0, 0, 200, 200]


def test_stages_are_pictures_with_words(client, prints):
    found = client.post("/stages", files=sent(prints, image="1_1.png")).json()
    names = [stage["name"] for stage in found["stages"]]
    assert (names[0], names[-1]) == ("input", "minutiae")
    assert all(stage["words"] for stage in found["stages"])
    assert all(stage["picture"].startswith("data:image/webp") for stage in found["stages"])


@pytest.fixture(scope="session")
def uploads(prints):
    """Return uploads that are refused, by name."""
    return prints | {
        "big.tif": bytes(3_000_000),
        "huge.pgm": b"P5 20000 20000 255\n",
        "wide.png": png(np.full((2600, 2600), 255, np.uint8), dpi=None),
    }


@pytest.mark.parametrize(
    ("name", "status", "words"),
    [
        ("text.png", 422, "text.png: not an image of a known format"),
        ("truncated.png", 422, "truncated.png: "),
        ("empty.png", 422, "empty.png: the file is empty"),
        ("big.tif", 413, "big.tif: larger than 2 MB"),
        ("huge.pgm", 422, "huge.pgm: image is too large: more than"),
        ("wide.png", 422, "wide.png: 2600 x 2600 pixels at 500 dpi are more than this server"),
        (None, 422, "probe: field required"),
    ],
)
def test_a_bad_file_is_one_sentence(client, uploads, name, status, words):
    files = sent(uploads, reference="1_1.png") | ({} if name is None else sent(uploads, probe=name))
    answer = client.post("/verify", files=files)
    assert (answer.status_code, list(answer.json())) == (status, ["error"])
    sentence = answer.json()["error"]
    assert sentence.startswith(words)
    assert "\n" not in sentence
    assert tempfile.gettempdir() not in sentence


def test_addresses_and_methods_that_are_not_there(client):
    assert client.get("/nothing").json() == {"error": "there is nothing at this address"}
    assert client.get("/%2e%2e/app.py").status_code == 404
    assert client.post("/nothing").status_code == 404
    assert client.post("/identify").status_code == 404  # no gallery was given: no such address


def test_nothing_is_left_in_the_temporary_folder(prints, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))  # for the workers
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # for the server
    with serving() as client:
        for name in ("1_1.png", "text.png"):
            files = {"probe": (name, prints[name]), "reference": ("r", bytes(1_900_000))}
            assert client.post("/verify", files=files).status_code == 422
            assert list(tmp_path.iterdir()) == []


def test_many_at_once_get_each_its_own_answer(client, prints):
    names = ["1_1.png", "1_2.png", "2_1.png"]
    pairs = [(a, b) for a in names for b in names if a != b][: 6 if COMPILED else 1]

    def ask(pair):
        files = sent(prints, probe=pair[0], reference=pair[1])
        answer = client.post("/verify", files=files)
        assert answer.status_code == 200
        return answer.json()

    alone = {pair: ask(pair) for pair in pairs}
    with ThreadPoolExecutor(8) as people:
        assert list(people.map(ask, pairs * 2)) == [alone[pair] for pair in pairs * 2]


def test_too_long_work_is_stopped_and_the_next_is_done(prints):
    with serving(limits=Limits(seconds=1e-3)) as impatient:
        answer = impatient.post("/extract", files=sent(prints, image="1_1.png"))
        assert answer.status_code == 504
        assert "was stopped" in answer.json()["error"]
        assert impatient.get("/about").status_code == 200


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("a place") / "prints.db"


@pytest.fixture(scope="module")
def searched(place):
    with served_gallery(place) as client:
        yield client


@pytest.fixture
def http(searched, place):
    """Return a client of a server whose gallery is emptied after the test."""
    yield searched
    with open_gallery(place) as gallery:
        gallery.remove([entry.id for entry in gallery.entries()])


def test_a_print_of_another_person_is_told_when_it_is_enrolled(prints, http):
    copy = io.BytesIO()
    Image.open(io.BytesIO(prints["1_1.png"])).save(copy, "bmp", dpi=(500, 500))
    for name in ("1_1.png", "2_1.png"):
        done = http.post("/enrol", files=sent(prints, image=name)).json()
        assert (done["subject_existed"], done["unmatched"]) == (False, None)
    files = {"image": ("2_2.bmp", copy.getvalue())}
    merged = http.post("/enrol", files=files).json()
    assert (merged["enrolled"], merged["subject_existed"]) == (True, True)
    assert merged["unmatched"].startswith("2_2 does not match 2_1: another finger")
    assert http.post("/enrol", files=files).json()["unmatched"] is None  # it is known


def test_identical_prints_are_called_so(client, prints):
    files = sent(prints, probe="1_1.png", reference="1_1.png")
    assert client.post("/verify", files=files).json()["identical"] == "pixels"
    rows = client.post("/compare", files=files).json()["rows"]
    assert rows[0]["label"] == "Identical"
    assert not {"FMR"} & {row["label"] for row in rows}
    files = sent(prints, probe="1_1.png", reference="1_2.png")
    assert client.post("/verify", files=files).json()["identical"] is None


def test_a_gallery_is_enrolled_in_and_searched(prints, http, place):
    done = http.post("/enrol", files=sent(prints, image="1_1.png"))
    assert done.status_code == 201
    assert (done.json()["subject"], done.json()["impression"]) == ("1", "1")
    again = http.post("/enrol", files=sent(prints, image="1_1.png"))
    assert (again.status_code, again.json()["enrolled"]) == (200, False)
    label = {"subject": "ada already (a/b)", "finger": "left"}
    other = http.post("/enrol", files=sent(prints, image="2_1.png"), data=label)
    assert other.json()["subject"] == label["subject"]
    taken = http.post("/enrol", files=sent(prints, image="1_2.png"), data=label)
    why = "another picture is enrolled as ada already (a/b)_left already (2_1.png)"
    assert (taken.status_code, taken.json()["error"]) == (409, f"1_2.png: {why}")
    unnamed = http.post("/enrol", files={"image": ("holiday.png", prints["1_2.png"])})
    assert unnamed.status_code == 422
    blank = http.post("/enrol", files={"image": ("9_1.png", prints["blank.png"])})
    assert blank.json()["error"] == "9_1.png: no minutiae found"
    assert http.get("/gallery").json()["impressions"] == 2

    files = sent(prints, probe="1_2.png")
    found = http.post("/identify", files=files, data={"candidates": 1}).json()
    assert (found["compared"], len(found["candidates"])) == (2, 1)
    best = found["candidates"][0]
    assert (best["subject"], best["source"]) == ("1", "1_1.png")
    shown = http.post(f"/gallery/{best['id']}/compare", files=files).json()
    assert shown["result"]["match"]
    assert shown["reference"]["kind"] == "template"
    overlay = http.post(f"/gallery/{best['id']}/overlay", files=files)
    assert overlay.content.startswith(b"\x89PNG")
    views = http.post(f"/gallery/{best['id']}/views", files=files).json()
    assert views["ridges"]["mean"] == pytest.approx(shown["result"]["compared"]["ridge_agreement"])
    missing = http.post("/gallery/77/compare", files=files)
    assert missing.status_code == 404
    assert str(place.parent) not in missing.text


def test_the_api_describes_itself(client):
    paths = client.get("/openapi.json").json()["paths"]
    assert set(paths) == {
        *("/verify", "/extract", "/overlay", "/compare", "/stages", "/case-report", "/views"),
        *("/about", "/health", "/ready", "/metrics"),
    }
    extracted = paths["/extract"]["post"]["responses"]
    assert set(extracted["200"]["content"]) == {"application/json", "application/octet-stream"}
    assert "415" in extracted


def test_the_page_is_light_and_brings_all_it_needs():
    files = [path for path in STATIC.iterdir() if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 90_000
    for path in files:
        text = path.read_text(encoding="utf-8")
        foreign = set(re.findall(r"https?://[^\s\"'`]+", text)) - {"http://www.w3.org/2000/svg"}
        assert not foreign, path.name
        if path.suffix == ".html":
            assert not re.search(r"<script(?![^>]* src=)|\son\w+=|\sstyle=|javascript:", text)
        assert "innerHTML" not in text


def test_the_page_and_its_parts_are_served(client):
    page = client.get("/")
    assert page.headers["content-type"].startswith("text/html")
    for name in re.findall(r'(?:src|href)="([\w.-]+\.(?:js|css|svg|html))"', page.text):
        assert client.get(f"/{name}").status_code == 200, name


def test_a_template_that_would_be_damage_is_refused_and_not_stored(http):
    template = (
        '{"format": "fpmatch-template", "version": 2, "width": 300, "height": 400, "dpi": 500.0, '
        '"minutiae": {"x": [1], "y": [2], "angle": [1], "kind": [1], "quality": [9]}, '
        '"ridge_field": {"step": STEP, "rows": 1, "columns": 2, "orientation": "AAAAAAAAAAA=", '
        '"mask": "wA=="}}'
    )
    for step in ("1e-50", "5e-324", "1e30"):
        data = template.replace("STEP", step).encode()
        answer = http.post("/enrol", files={"image": ("7_1.json", data)})
        assert answer.status_code == 400, answer.text
        assert "step" in answer.json()["error"]
    assert http.get("/gallery").json()["impressions"] == 0
    good = template.replace("STEP", "16.0").encode()
    assert http.post("/enrol", files={"image": ("7_1.json", good)}).status_code == 201
    assert http.get("/gallery").json()["impressions"] == 1
