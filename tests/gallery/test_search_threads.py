"""One probe is searched for by several threads, with the candidates of one thread."""

from __future__ import annotations

import json

import platformdirs
import pytest
from click.testing import CliRunner
from made_prints import entry_of, scattered

from fpmatch import identify as identify_in
from fpmatch.cli.group import fpmatch
from fpmatch.engine import in_threads
from fpmatch.engine.engine import serial
from fpmatch.engine.in_threads import Threads
from fpmatch.formats.files import save_template
from fpmatch.gallery import indexed_search, prepared_search
from fpmatch.gallery.candidates import identify_entries, identify_entries_fused
from fpmatch.gallery.entry import Label
from fpmatch.gallery.indexed_search import IndexedSearch
from fpmatch.gallery.search import open_search
from fpmatch.indexing.loss import SearchPlan
from fpmatch.matching.prints import candidate_list
from fpmatch.web import gallery as served

SIZE = 40
PROBES = [scattered(k, 10 + k % 25) for k in (3, 17, 100)]
KINDS = {
    "all": {"candidate_list": "off"},
    "candidate list": {"candidate_list": 9},
    "index": {},
}


@pytest.fixture(autouse=True)
def small_parts(tmp_path, monkeypatch):
    """Give each thread few prints at once; index galleries of more than ten."""
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda name: tmp_path / "cache" / name)
    monkeypatch.setattr(prepared_search, "COMPARED_AT_ONCE", 3)
    monkeypatch.setattr(candidate_list, "PRINTS_AT_ONCE", 4)
    monkeypatch.setattr(indexed_search, "PRINTS_AT_ONCE", 4)
    monkeypatch.setattr(indexed_search, "PREPARED_AT_ONCE", 2)
    for name in ("search", "prepared_search"):
        monkeypatch.setattr(f"fpmatch.gallery.{name}.LISTED_UP_TO", 10)
    monkeypatch.setattr(
        indexed_search, "search_plan", lambda loss, *_: SearchPlan(loss, 0.5, 20, 7)
    )


@pytest.fixture
def filled(gallery):
    """Return a gallery whose index has several segments, without two prints of them."""
    for first in range(0, SIZE, 10):
        numbers = range(first, first + 10)
        gallery.add(
            [entry_of(k, scattered(k, 10 + k % 25), Label(str(k // 2), str(k))) for k in numbers]
        )
        open_search(gallery, engine=serial())
    gallery.remove([4, 21])
    return gallery


@pytest.fixture
def helpers(monkeypatch):
    """Return a list of the threads that begin to help a search."""
    begun, start = [], Threads._start
    monkeypatch.setattr(
        Threads, "_start", lambda self, work: begun.append(self) or start(self, work)
    )
    return begun


@pytest.mark.parametrize("kind", KINDS)
def test_candidates_do_not_depend_on_the_number_of_threads(filled, helpers, kind):
    search = open_search(filled, engine=serial(), **KINDS[kind])
    assert isinstance(search, IndexedSearch) == (kind == "index")
    if kind == "index":
        assert len(search.state.segments) > 1
    for probe in PROBES:
        for more in ({}, {"transforms": True}, {"impressions": True}, {"by_subject": True}):
            helpers.clear()
            options = KINDS[kind] | more
            expected, entries = identify_entries(filled, search, probe, workers=1, **options)
            assert not helpers
            assert len(expected.candidates) >= 7
            assert not {4, 21} & {one.number for one in expected.candidates}
            for workers in (2, 3):
                found, others = identify_entries(filled, search, probe, workers=workers, **options)
                assert helpers
                assert repr(found) == repr(expected)
                assert others == entries


def test_other_matchers_are_compared_in_one_thread(filled, helpers):
    search = open_search(filled, "paper", engine=serial())
    one, two = (identify_entries(filled, search, PROBES[0], workers=k)[0] for k in (1, 2))
    assert repr(one) == repr(two)
    assert not helpers


@pytest.mark.parametrize("kind", KINDS)
def test_a_search_by_several_fingers_has_threads_too(filled, helpers, kind):
    search = open_search(filled, engine=serial(), **KINDS[kind])
    one, two = (
        identify_entries_fused(filled, search, PROBES[:2], workers=k, **KINDS[kind])[0]
        for k in (1, 2)
    )
    assert repr(one) == repr(two)
    assert helpers


def test_all_cores_are_the_default(filled, helpers, monkeypatch):
    monkeypatch.setattr(in_threads, "available_cores", lambda: 3)
    search = open_search(filled, engine=serial())
    identify_entries(filled, search, PROBES[0])
    assert helpers


def test_the_function_of_the_package_takes_a_number_of_threads(filled, helpers):
    expected = identify_in(filled, PROBES[1], workers=1)
    assert not helpers
    assert identify_in(filled, PROBES[1], workers=2) == expected
    assert helpers
    with pytest.raises(ValueError, match="workers"):
        identify_in(filled, PROBES[1], workers=0)


def test_the_command_takes_a_number_of_threads(filled, helpers, tmp_path):
    save_template(tmp_path / "probe.json", PROBES[1])
    found = []
    for workers in ("1", "2"):
        assert not helpers
        words = ["identify", filled.name, str(tmp_path / "probe.json"), "--workers", workers]
        done = CliRunner().invoke(fpmatch, [*words, "--json"])
        assert done.exit_code == 0, done.output
        document = json.loads(done.stdout)
        del document["probes"][0]["seconds"]
        found.append(document)
    assert helpers
    assert found[0] == found[1]


def test_the_server_searches_in_one_thread(filled, helpers, monkeypatch):
    """Its workers are processes: as many as there are cores."""

    class Given:
        template, name, notes = PROBES[0], "probe.tif", ()

    class Reading:
        class limits:
            candidates = 10

    class Upload:
        data = b"probe"

    monkeypatch.setattr(served, "_kept", {})
    monkeypatch.setattr(served, "open_upload_with_minutiae", lambda *_: Given)
    monkeypatch.setattr(in_threads, "available_cores", lambda: 2)
    name = str(filled.path if hasattr(filled, "path") else filled.name)
    found = served.identify_print(Upload, Reading, name, "unit-circle", 5, 0.0)
    assert len(found["candidates"]) == 5
    assert not helpers
