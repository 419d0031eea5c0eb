"""The HTTP API answers as the commands do: two prints, one print, a gallery."""

import io
import json
import re
import tempfile
from concurrent.futures import ThreadPoolExecutor
from itertools import permutations
from pathlib import Path

import pytest
import sqlalchemy as sa
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from fpmatch.formats.files import load_template
from fpmatch.gallery.encryption.keys import load_keys, make_keys
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.store.audit import check_audit, events_of, switch
from fpmatch.image.skeleton._thin_kernel import COMPILED
from fpmatch.matching.constants import IMPOSTOR_RIDGES
from fpmatch.prints.reading import ASSUMED_DPI
from fpmatch.server import gallery as gallery_work
from fpmatch.server.gallery import describe_gallery, enrol_print
from fpmatch.server.prints import LONGEST_NAME, Upload, shown_name
from fpmatch.server.settings import STATIC, Limits, Role

from .conftest import bearer, clients, serving


@pytest.fixture(autouse=True)
def written(prints, tmp_path, monkeypatch):
    """Work in a folder with the files that requests send."""
    monkeypatch.chdir(tmp_path)
    for name in ("1_1.png", "1_2.png", "2_1.png"):
        Path(name).write_bytes(prints[name])


@pytest.mark.parametrize(
    ("reference", "options", "match"),
    [
        ("1_2.png", {}, True),
        ("2_1.png", {}, False),
        ("1_2.png", {"fmr": 0.01, "probe_dpi": 450, "dpi": 500, "matcher": "paper"}, True),
        ("1_2.png", {"matcher": "paper:rho=0.05,area_tolerance=0.2"}, True),
    ],
)
def test_verify_answers_as_the_command_does(run, server, sent, reference, options, match):
    answer = server.post("/verify", files=sent(probe="1_1.png", reference=reference), data=options)
    assert (answer.status_code, answer.headers["cache-control"]) == (200, "no-store")
    words = [f"--{name.replace('_', '-')}={value}" for name, value in options.items()]
    printed = json.loads(run("verify", "1_1.png", reference, "--json", *words).stdout)
    assert answer.json() == printed
    assert printed["match"] == match


def test_extract_returns_the_template_that_the_command_writes(run, server, prints, sent):
    files = sent(image="1_1.png")
    answer = server.post("/extract", files=files)
    Path("sent.json").write_bytes(answer.content)
    assert run("extract", "1_1.png", "-o", "out").exit_code == 0
    assert load_template("sent.json") == load_template("out/1_1.json")
    pair = {"probe": ("1_1.json", answer.content), "reference": ("1.png", prints["1_1.png"])}
    again = server.post("/compare", files=pair).json()
    assert again["result"]["score"] > 40
    assert again["probe"]["kind"] == "template"
    assert again["probe"]["ink"].startswith("data:image/png;base64,")  # it contains ridges
    other = server.post("/extract", files=files, data={"format": "iso2005"})
    assert other.content.startswith(b"FMR\0")
    assert "template.iso" in other.headers["content-disposition"]
    pair["probe"] = ("1_1.iso", other.content)
    of_minutiae = server.post("/compare", files=pair).json()["probe"]
    assert (of_minutiae["kind"], of_minutiae["ink"]) == ("template", None)
    x, y, *_ = zip(*of_minutiae["minutiae"], strict=True)
    assert of_minutiae["extent"] == [*map(round, (min(x), min(y), max(x), max(y)))]


def test_compare_views_and_overlays_show_the_same_comparison(server, sent):
    files = sent(probe="1_1.png", reference="1_2.png")
    shown = server.post("/compare", files=files).json()
    probe, reference, compared = shown["probe"], shown["reference"], shown["result"]["compared"]
    assert len(shown["pairs"]) == shown["result"]["pairs"] > 5
    assert (probe["width"], probe["height"]) == (280, 300)
    assert probe["picture"].startswith("data:image/webp;base64,")
    assert reference["ink"].startswith("data:image/png;base64,")
    most_i, most_j = map(max, zip(*shown["pairs"], strict=True))
    assert most_i < len(probe["minutiae"])
    assert most_j < len(reference["minutiae"])
    assert {"Minutiae", "Transform"} <= {row["label"] for row in shown["rows"]}
    ridges = server.post("/views", files=files).json()["ridges"]
    assert ridges["mean"] == pytest.approx(compared["ridge_agreement"], rel=1e-12)
    assert ridges["area_mm2"] == compared["ridge_area_mm2"]
    assert ridges["impostor_mean"] == IMPOSTOR_RIDGES
    assert {len(cell) for cell in ridges["cells"]} == {4}
    values = [cell[2] for cell in ridges["cells"]]
    assert sum(values) / len(values) == pytest.approx(ridges["mean"], abs=1e-4)
    assert all(re.fullmatch("#[0-9a-f]{6}", cell[3]) for cell in ridges["cells"])
    picture = server.post("/overlay", files=files)
    assert picture.headers["content-type"] == "image/png"
    assert Image.open(io.BytesIO(picture.content)).size[0] >= 800
    drawing = server.post("/overlay", files=files, data={"format": "svg", "side_by_side": "true"})
    assert drawing.headers["content-type"] == "image/svg+xml"
    assert drawing.text.startswith("<svg")


def test_prints_that_say_little_are_shown_with_notes(server, sent):
    shown = server.post("/compare", files=sent(probe="untagged.tif", reference="blank.png")).json()
    assert shown["probe"]["notes"] == [ASSUMED_DPI]
    assert shown["reference"]["notes"] == []
    assert shown["result"]["match"] is False
    assert shown["result"]["transform"] is None
    assert shown["result"]["reason"]
    assert shown["reference"]["extent"] == [0, 0, 200, 200]
    views = server.post("/views", files=sent(probe="blank.png", reference="1_2.png"))
    assert views.json() == {"ridges": None}


def test_identical_and_mirrored_prints_are_called_so(server, sent):
    files = sent(probe="1_1.png", reference="1_1.png")
    assert server.post("/verify", files=files).json()["identical"] == "pixels"
    rows = server.post("/compare", files=files).json()["rows"]
    assert rows[0]["label"] == "Identical"
    assert "FMR" not in {row["label"] for row in rows}
    answer = server.post("/verify", files=sent(probe="mirrored.png", reference="1_1.png")).json()
    assert (answer["match"], answer["identical"]) == (False, None)
    assert "mirrored, the probe matches" in answer["reason"]


def test_stages_are_pictures_with_words(server, sent):
    stages = server.post("/stages", files=sent(image="1_1.png")).json()["stages"]
    assert (stages[0]["name"], stages[-1]["name"]) == ("input", "minutiae")
    assert all(stage["words"] for stage in stages)
    assert all(stage["picture"].startswith("data:image/webp") for stage in stages)


def test_a_case_report_contains_notes_and_marks(server, sent):
    files = sent(probe="1_1.png", reference="1_1.png")
    marks = json.dumps([{"side": "probe", "x": 10, "y": 20, "note": "a scar"}] * 2)
    data = {"notes": "seen <twice>\r\nand so on", "marks": marks, "case_number": "2026-17"}
    response = server.post("/case-report", files=files, data=data)
    assert response.headers["content-type"].startswith("text/html")
    assert "a scar" in response.text
    assert "seen &lt;twice&gt;\nand so on" in response.text
    assert re.findall(r"<tr><td><b>(\w)</b>", response.text) == ["A", "B"]
    assert "<title>Case 2026-17: " in response.text
    long = server.post("/case-report", files=files, data={"notes": "a\r\n" * 33_000})
    assert long.text.count("\na") >= 32_999


def test_many_at_once_get_each_its_own_answer(server, sent):
    pairs = list(permutations(("1_1.png", "1_2.png", "2_1.png"), 2))[: 6 if COMPILED else 1]

    def ask(pair):
        return server.post("/verify", files=sent(probe=pair[0], reference=pair[1])).json()

    alone = {pair: ask(pair) for pair in pairs}
    with ThreadPoolExecutor(8) as people:
        assert list(people.map(ask, pairs * 2)) == [alone[pair] for pair in pairs * 2]


def test_nothing_is_left_in_the_temporary_folder(sent, tmp_path, monkeypatch):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))  # for the workers
    monkeypatch.setattr(tempfile, "tempdir", str(folder))  # for the server
    with serving() as client:
        for name in ("1_1.png", "text.png"):
            files = sent(probe=name) | {"reference": ("r", bytes(1_900_000))}
            assert client.post("/verify", files=files).status_code == 422
            assert list(folder.iterdir()) == []


def test_the_page_brings_all_it_needs(server):
    page = server.get("/")
    assert page.headers["content-type"].startswith("text/html")
    assert page.headers["cache-control"] == "no-cache"
    named = set(re.findall(r'(?:src|href)="([\w.-]+\.(?:js|css|svg|html))"', page.text))
    assert {"main.js", "style.css"} <= named
    assert sum(path.stat().st_size for path in STATIC.iterdir()) < 90_000
    for path in STATIC.iterdir():
        text = server.get(f"/{path.name}", headers={"authorization": ""}).text
        foreign = set(re.findall(r"https?://[^\s\"'`]+", text)) - {"http://www.w3.org/2000/svg"}
        assert not foreign, path.name
        if path.suffix == ".html":
            assert not re.search(r"<script(?![^>]* src=)|\son\w+=|\sstyle=|javascript:", text)
        assert "innerHTML" not in text
        named |= set(re.findall(r'from "\./([\w.]+)"', text))
    assert named | {"index.html"} == {path.name for path in STATIC.iterdir()}


@given(st.text())
def test_a_name_of_an_upload_is_one_short_line_without_folders(given_name):
    name = shown_name(given_name, "probe")
    assert name
    assert name.isprintable()
    assert len(name) <= LONGEST_NAME
    assert not set(name) & set("/\\")
    assert name.strip(".")
    assert shown_name("101_3.tif", "probe") == "101_3.tif"


def test_a_print_of_another_person_is_told_when_it_is_enrolled(prints, sent, http):
    done = http.post("/enrol", files=sent(image="2_1.png")).json()
    assert (done["subject_existed"], done["unmatched"]) == (False, None)
    files = {"image": ("2_2.png", prints["1_1.png"])}
    merged = http.post("/enrol", files=files).json()
    assert (merged["enrolled"], merged["subject_existed"]) == (True, True)
    assert merged["unmatched"].startswith("2_2 does not match 2_1: another finger")
    assert http.post("/enrol", files=files).json()["unmatched"] is None  # it is known


def test_enrolment_is_by_name_or_label_and_refuses_another_picture(prints, sent, http):
    done = http.post("/enrol", files=sent(image="1_1.png"))
    assert done.status_code == 201
    assert (done.json()["subject"], done.json()["impression"]) == ("1", "1")
    again = http.post("/enrol", files=sent(image="1_1.png"))
    assert (again.status_code, again.json()["enrolled"]) == (200, False)
    label = {"subject": "ada already (a/b)", "finger": "left"}
    other = http.post("/enrol", files=sent(image="2_1.png"), data=label)
    assert other.json()["subject"] == label["subject"]
    taken = http.post("/enrol", files=sent(image="1_2.png"), data=label)
    why = "another picture is enrolled as ada already (a/b)_left already (2_1.png)"
    assert (taken.status_code, taken.json()["error"]) == (409, f"1_2.png: {why}")
    unnamed = http.post("/enrol", files={"image": ("holiday.png", prints["1_2.png"])})
    assert unnamed.status_code == 422
    blank = http.post("/enrol", files={"image": ("9_1.png", prints["blank.png"])})
    assert blank.json()["error"] == "9_1.png: no minutiae found"
    assert http.get("/gallery").json()["impressions"] == 2


def test_a_gallery_is_searched_compared_with_and_audited(run, sent, tmp_path, gallery):
    for name, finger in (("1_1.png", "left"), ("2_1.png", "right")):
        path = Path(name).rename(tmp_path / f"ada_{finger}.png")  # the gallery has its whole path
        done = run("enrol", gallery, path, "--pattern", "(?P<subject>[a-z]+)_(?P<finger>[a-z]+)")
        assert done.exit_code == 0, done.stderr
    command = ("identify", gallery, "1_2.png", "--json")
    (printed,) = json.loads(run(*command).stdout)["probes"]
    with open_gallery(gallery) as opened:
        switch(opened, on=True)
    with serving(gallery=gallery, clients=clients()) as http:
        http.headers.update(bearer(Role.ADMIN))
        probe = sent(probe="1_2.png")
        answer = http.post("/identify", files=probe).json()
        claim = http.post("/gallery/verify", files=probe, data={"subject": "ada"}).json()
        assert (claim["match"], claim["best"]["finger"], claim["best"]["source"]) == (
            *(True, "left"),
            "ada_left.png",
        )
        entries = http.get("/gallery/prints?subject=ada").json()["prints"]
        assert [one["source"] for one in entries] == ["ada_left.png", "ada_right.png"]
        (best,), (other,) = answer["candidates"], printed["candidates"]  # one of each subject
        moved = {name: best.pop(name) for name in ("transform", "pairs", "rms_px")}
        assert moved["transform"]["rotation_deg"] == pytest.approx(90, abs=1)
        assert best == other | {"source": "ada_left.png"}
        at = f"/gallery/{best['id']}"
        shown = http.post(f"{at}/compare", files=probe).json()
        assert shown["result"]["match"]
        assert {name: shown["result"][name] for name in moved} == moved
        assert shown["reference"]["kind"] == "template"
        assert http.post(f"{at}/overlay", files=probe).content.startswith(b"\x89PNG")
        ridges = http.post(f"{at}/views", files=probe).json()["ridges"]
        assert ridges["mean"] == pytest.approx(shown["result"]["compared"]["ridge_agreement"])
        report = http.post(f"{at}/case-report", files=probe, data={"notes": "a scar"})
        assert "a scar" in report.text
        assert "ada_left.png" in report.text
        missing = http.post("/gallery/77/compare", files=probe)
        assert missing.json() == {"error": "no entry has the number 77"}
        assert http.delete(at).json() == {"removed": 1}
        assert http.delete(at).status_code == 404
        assert http.delete("/gallery/prints?subject=ada").json() == {"removed": 1}
        assert http.delete("/gallery/prints?subject=ada").status_code == 404
    with open_gallery(gallery) as opened:
        events = [event for _, _, event in events_of(opened)]
        assert check_audit(opened)[0] == len(events)
    text = json.dumps(events)
    actions = {"identify": 1, "verify": 1, "compare": 4, "list": 1, "remove": 2}
    for action, times in actions.items():
        assert text.count(f'"action": "{action}"') == times, action
    assert text.count('"client": "admin"') == 9
    assert "score" not in text


def test_nothing_takes_long_once_a_print_is_stored_nor_to_count_them(gallery, prints, monkeypatch):
    open_gallery(gallery, create=True).close()
    stored, read = [], []

    def compare(opened, *_):
        stored.append(len(opened))

    monkeypatch.setattr(gallery_work, "find_unmatched", compare)
    for name in ("1_1.png", "2_1.png"):
        enrol_print(Upload(name, prints[name], Limits()), str(gallery), None)
    assert stored == [0, 1]

    def note(connection, cursor, statement, parameters, context, executemany):
        read.extend(re.findall(r"\bfpmatch_entry\.(\w+)", statement))

    sa.event.listen(sa.Engine, "before_cursor_execute", note)
    try:
        counted = describe_gallery(str(gallery))
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", note)
    assert (counted["impressions"], counted["subjects"]) == (2, 2)
    assert set(read) == {"subject"}  # which an index has: no row is read


def test_an_encrypted_gallery_is_used_with_its_key_and_named_without(
    tmp_path, gallery, sent, monkeypatch
):
    source = make_keys(f"file:{tmp_path / 'secret-keys'}").source
    open_gallery(gallery, create=True, key=source, encrypt=True).close()
    monkeypatch.setenv("FPMATCH_KEY", source)
    with serving(gallery=gallery) as http:
        assert http.post("/enrol", files=sent(image="1_1.png")).status_code == 201
        listed = http.post("/identify", files=sent(probe="1_2.png")).json()["candidates"]
        assert listed[0]["subject"] == "1"
        assert http.get("/gallery").json()["keys"] == list(load_keys(source).ids)
    (key_id,) = load_keys(source).ids
    monkeypatch.setenv("FPMATCH_KEY", "file:/nowhere/secret-keys")
    with serving(gallery=gallery) as http:
        refused = http.post("/enrol", files=sent(image="2_1.png"))
    assert refused.status_code == 500
    why = "the gallery is encrypted, and the server has not its key: the log"
    assert refused.json()["error"].startswith(why)
    assert not any(word in refused.text for word in (key_id, "secret-keys", "nowhere"))
