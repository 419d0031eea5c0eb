"""Templates of an unfinished run are encrypted where a key was given."""

import sqlite3
from contextlib import closing

import pytest

from fpmatch.errors import ScoringError
from fpmatch.gallery.batch.sources import StoredTemplate
from fpmatch.gallery.batch.unfinished import Unfinished

DATA = bytes(range(200))
ITEMS = {1: StoredTemplate(DATA), 2: StoredTemplate(None, "no print", notes=("a note",), quality=3)}

pytestmark = pytest.mark.usefixtures("source")


def begun(tmp_path):
    with Unfinished(tmp_path / "out.csv", {"what": "a run"}) as store:
        store.collect("probes", [1, 2], lambda some: (ITEMS[k] for k in some), lambda *_: None)
        assert store.prints("probes", [1, 2]) == ITEMS
    return tmp_path / "out.csv.unfinished" / "state.db"


def resumed(tmp_path):
    with Unfinished(tmp_path / "out.csv", {"what": "a run"}) as store:
        return store.prints("probes", [1, 2])


def test_nothing_is_readable_and_the_run_resumes(tmp_path):
    state = begun(tmp_path)
    assert DATA[:16] not in state.read_bytes()
    assert resumed(tmp_path) == ITEMS


def test_without_the_key_it_does_not_resume(tmp_path, monkeypatch):
    begun(tmp_path)
    monkeypatch.delenv("FPMATCH_KEY")
    with pytest.raises(ScoringError, match="give it with FPMATCH_KEY"):
        resumed(tmp_path)


def test_a_template_of_another_print_is_refused(tmp_path):
    state = begun(tmp_path)
    with closing(sqlite3.connect(state)) as connection, connection:
        row = connection.execute("SELECT * FROM item WHERE number = 1").fetchone()
        moved = ("references", *row[1:])
        connection.execute("INSERT INTO item VALUES (?, ?, ?, ?, ?, ?, ?, ?)", moved)
    with (
        Unfinished(tmp_path / "out.csv", {"what": "a run"}) as store,
        pytest.raises(ScoringError, match="damaged"),
    ):
        store.prints("references", [1])
