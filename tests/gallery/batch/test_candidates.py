"""`fpmatch.gallery.batch.candidates`: the same file on every engine, whatever is killed."""

import csv
import hashlib
import json
import secrets
import shutil
import sqlite3
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from made_prints import entries_of, entry_of, scattered

from fpmatch.errors import GalleryError, ImageReadError, MatcherError, OutputError, ScoringError
from fpmatch.formats.files import save_template
from fpmatch.gallery.batch import candidates as candidates_module
from fpmatch.gallery.batch.candidates import COLUMNS, write_candidates
from fpmatch.gallery.batch.sources import FolderSource
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.gallery.search import identify as identify_module
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.search import Search, SearchOptions
from fpmatch.gallery.store.audit import events_of, switch

OPTIONS = {
    "usual": SearchOptions(listed="subjects", count=3),
    "over a threshold": SearchOptions(listed="subjects", count=2, threshold=1.0),
    "fingers": SearchOptions(listed="fingers", count=4),
}


@pytest.fixture(scope="module")
def probes(tmp_path_factory):
    """Return a folder of twelve templates, of which two cannot be read."""
    folder = tmp_path_factory.mktemp("made") / "probes"
    folder.mkdir()
    for k in range(10):
        save_template(folder / f"{k}.json", scattered(k, 12 + k))
    (folder / "broken.json").write_text("{")
    (folder / "a=1.json").write_bytes(b"\xff")
    return folder


@pytest.fixture(scope="module")
def whole_gallery(tmp_path_factory):
    """Return the folder of a gallery of sixty prints."""
    folder = tmp_path_factory.mktemp("gallery")
    with open_gallery(folder / "prints.db", create=True) as opened:
        opened.add(entries_of(*(scattered(k % 37, 12 + k % 37) for k in range(60))))
    return folder


@pytest.fixture
def gallery(whole_gallery, tmp_path):
    shutil.copytree(whole_gallery, tmp_path, dirs_exist_ok=True)
    with open_gallery(tmp_path / "prints.db") as opened:
        yield opened


@pytest.fixture(autouse=True)
def small_batches(monkeypatch):
    """Several batches: enough for runs that are interrupted."""
    monkeypatch.setattr(identify_module, "BATCH", 2)


def run(gallery, folder, output, options=OPTIONS["usual"], engine=None, **more):
    search = Search(gallery)
    source = FolderSource(folder, find_prints([folder]), None, "auto", None)
    done = write_candidates(search, source, output, options, engine=engine, **more)
    return done, output.read_bytes()


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_rows_are_the_candidates_of_single_searches(gallery, probes, tmp_path, options):
    done, content = run(gallery, probes, tmp_path / "c.csv", options)
    with (tmp_path / "c.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert content.startswith((",".join(COLUMNS) + "\n").encode())
    assert (done.probes, done.failed, done.resumed, done.rows) == (12, 2, 0, len(rows))
    assert [Path(path).name for path, _ in done.failures] == ["a=1.json", "broken.json"]
    search = Search(gallery)
    for k in range(10):
        result = identify(search, scattered(k, 12 + k), options)
        found = [row for row in rows if Path(row["probe"]).name == f"{k}.json"]
        expected = [
            {name: str(value) for name, value in one.items() if name != "extrapolated"}
            for one in result.candidate_dicts()
        ]
        shown = [
            {name: row[name] for name in one} for row, one in zip(found, expected, strict=True)
        ]
        assert shown == expected
        assert {(row["enrolled"], row["compared"], row["reason"]) for row in found} == {
            ("60", str(result.compared), "")
        }


def test_a_probe_without_candidates_has_a_row(gallery, probes, tmp_path):
    _, content = run(gallery, probes, tmp_path / "c.csv", SearchOptions(threshold=100.0))
    rows = list(csv.DictReader(content.decode().splitlines()))
    assert len(rows) == 12
    assert [row["reason"] for row in rows].count("no candidate") == 10
    assert {row["rank"] for row in rows} == {""}


def test_json_lines_have_a_document_for_each_probe(gallery, probes, tmp_path):
    options = SearchOptions(listed="subjects", count=2, transforms=True)
    done, content = run(gallery, probes, tmp_path / "c.jsonl", options)
    documents = {Path(one["probe"]).name: one for one in map(json.loads, content.splitlines())}
    assert (done.probes, done.failed, done.rows, len(documents)) == (12, 2, 12, 12)
    search = Search(gallery)
    about = {"gallery": gallery.name, "matcher": search.matcher.name, "listed": "subjects"}
    for k in range(10):
        result = identify(search, scattered(k, 12 + k), options)
        numbers = {name: getattr(result, name) for name in ("enrolled", "compared", "fingers")}
        found = documents[f"{k}.json"]
        assert found.items() >= {**about, **numbers, "effort": None, "passed_on": []}.items()
        assert found["candidates"] == result.candidate_dicts()
        assert found["reason"] is None
    failed = documents["broken.json"]
    assert failed.items() >= {**about, "enrolled": None, "candidates": []}.items()
    assert failed["reason"] == dict(done.failures)[failed["probe"]]


class Stopped(Exception):
    """Stands for a kill."""


def stop_after(most, stage, done, total):
    if done >= most:
        raise Stopped


@pytest.mark.parametrize(
    ("most", "suffix"), [(0, ".csv"), (6, ".csv"), (11, ".csv"), (6, ".jsonl")]
)
def test_an_interrupted_run_is_resumed_to_the_same_file(gallery, probes, tmp_path, most, suffix):
    expected, content = run(gallery, probes, tmp_path / f"whole{suffix}")
    output = tmp_path / f"c{suffix}"
    with pytest.raises(Stopped):
        run(gallery, probes, output, progress=partial(stop_after, most))
    assert not output.exists()
    again, found = run(gallery, probes, output)
    assert found == content
    assert again.resumed == most
    assert (again.rows, again.failed) == (expected.rows, expected.failed)
    assert list(tmp_path.glob("c.*")) == [output]


def test_another_run_is_not_resumed(gallery, probes, tmp_path):
    output = tmp_path / "c.csv"
    with pytest.raises(Stopped):
        run(gallery, probes, output, progress=partial(stop_after, 4))
    for changes, what in (
        ({"count": 4}, "number of candidates"),
        ({"listed": "fingers"}, "list"),
        ({"transforms": True}, "list"),
        ({"threshold": 2.0}, "threshold"),
        ({"by_chance": 0.1}, "threshold"),
    ):
        with pytest.raises(ScoringError, match=f"an unfinished run, but with another {what}"):
            run(gallery, probes, output, replace(OPTIONS["usual"], **changes))
    gallery.add([entry_of(1000)])
    with pytest.raises(ScoringError, match="with another content of the gallery"):
        run(gallery, probes, output)


@pytest.mark.parametrize(
    ("name", "options", "error", "reason"),
    [
        ("c.txt", {}, OutputError, "candidates are written as .csv"),
        ("/dev/null/c.csv", {}, OutputError, "cannot be written: "),
        ("c.csv", {"count": 0}, MatcherError, "at least 1"),
        ("c.csv", {"threshold": 101.0}, MatcherError, "between 0 and 100"),
        ("c.csv", {"effort": 3}, MatcherError, "1, 2 or 4"),
    ],
)
def test_what_cannot_be_done_is_one_line(gallery, probes, tmp_path, name, options, error, reason):
    with pytest.raises(error, match=reason) as raised:
        run(gallery, probes, tmp_path / name, SearchOptions(**options))
    assert "\n" not in str(raised.value)
    assert not list(tmp_path.glob("c.*"))


def test_a_damaged_entry_is_no_candidate(gallery, probes, tmp_path):
    """Damage that happens after the prints were prepared is found where candidates are shown."""
    with closing(sqlite3.connect(tmp_path / "prints.db")) as database, database:
        database.execute("UPDATE fpmatch_entry SET dpi = 0 WHERE id = 4")
    _, content = run(gallery, probes, tmp_path / "c.csv")
    assert 4 in gallery.damaged
    rows = list(csv.DictReader(content.decode().splitlines()))
    assert "4" not in {row["id"] for row in rows}


def test_an_audit_states_what_was_searched_for_or_the_run_stops(
    gallery, probes, tmp_path, monkeypatch
):
    switch(gallery, on=True)
    run(gallery, probes, tmp_path / "c.csv")
    searched = [event for _, _, event in events_of(gallery) if event["action"] == "identify"]
    content = hashlib.sha256((probes / "0.json").read_bytes()).hexdigest()
    assert (searched[0]["probe"], len(searched[0]["candidates"])) == (content, 3)
    with monkeypatch.context() as patch:
        patch.setattr(candidates_module, "sha256_of", lambda path: secrets.token_hex(32))
        with pytest.raises(ImageReadError, match="was changed while it was searched for"):
            run(gallery, probes, tmp_path / "d.csv")

    def refuse(*_, **__):
        raise GalleryError("its audit cannot store the event", path="g")

    monkeypatch.setattr(gallery, "record", refuse)
    with pytest.raises(GalleryError, match="audit"):
        run(gallery, probes, tmp_path / "e.csv")
    assert not (tmp_path / "e.csv").exists()
