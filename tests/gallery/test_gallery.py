"""A gallery holds what was put into it, once, on either kind of database."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest
import sqlalchemy as sa
from made_prints import changed, entry_of, refused, scattered
from sqlalchemy.engine.default import DefaultDialect

from fpmatch.errors import GalleryError
from fpmatch.gallery import gallery as gallery_module
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import EnrolmentRequest, Failure, Label
from fpmatch.gallery.store import database, tables
from fpmatch.gallery.store.database import Database
from fpmatch.gallery.store.stored_template import unpack_template
from fpmatch.gallery.store.tables import ENROLLED, Conflict


def test_what_is_enrolled_is_there_when_opened_again(where, monkeypatch):
    monkeypatch.setattr(tables, "VALUES_PER_QUERY", 7)
    monkeypatch.setattr(database, "ROWS_PER_READ", 5)
    strange = Label("Ødegård '; drop table", "右人差し指", "1")  # names may be of any script
    new = [entry_of(99, label=strange, source="/Bücher/ñ.tif"), *map(entry_of, range(20))]
    with open_gallery(where, create=True) as gallery:
        assert len(gallery) == 0
        assert gallery.add(new) == [None] * 21
        mixed = [entry_of(k) for k in range(10, 30)]
        assert gallery.add(mixed) == [ENROLLED] * 10 + [None] * 10
    with open_gallery(where) as gallery:
        entries, templates = list(gallery.entries()), dict(gallery.templates())
        assert len(gallery) == len(entries) == 31
        assert list(templates) == sorted(entry.id for entry in entries)
        for entry, one in zip(entries, [*new, *mixed[10:]], strict=True):
            about = (one.label, one.source, one.content, 500.0, 5)
            assert (entry.label, entry.source, entry.content, entry.dpi, entry.minutiae) == about
            assert gallery.entry(entry.id) == entry
            assert templates[entry.id] == unpack_template(one.template)
            assert gallery.template(entry.id) == templates[entry.id]
        assert list(gallery.entries(subject=strange.subject)) == [entries[0]]
        refused(gallery.template, 77, code="unknown")
        refused(gallery.entry, 77, code="unknown")


def test_duplicates_are_failures_that_say_of_what(where):
    one, label = entry_of(1), Label("1", impression="1")
    same_picture = entry_of(1, label=Label("9"), source="/prints/9.tif")
    other_dpi = entry_of(1, scattered(1, 5, 569.0), source="/b.tif")
    reasons = [
        Conflict("the same picture is enrolled as 1_1 already", "/prints/1_1.tif"),
        Conflict("another picture is enrolled as 1_1 already", "/prints/1_1.tif"),
        Conflict("enrolled already, at 500 dpi, not 569"),
    ]
    with open_gallery(where, create=True) as gallery:
        # the first within the same batch, too
        assert gallery.add([one, same_picture]) == [None, reasons[0]]
        assert gallery.add([entry_of(2, label=label), other_dpi]) == reasons[1:]
        assert len(gallery) == 1
        sources = ("/prints/9.tif", "/prints/2_1.tif", "/b.tif")
        failed = [Failure(*one) for one in zip(sources, map(str, reasons), strict=True)]
        assert gallery.failures() == failed[::-1]
        asked = [(label, one.content, dpi) for dpi in (None, 500.0, 569.0)]
        asked += [(label, b"new"), (Label("2", impression="1"), b"new")]
        expected = [ENROLLED, ENROLLED, reasons[2], reasons[1], None]
        assert gallery.find_conflicts([EnrolmentRequest(*one) for one in asked]) == expected


def test_failures_are_kept_until_the_source_is_enrolled(where):
    with open_gallery(where, create=True) as gallery:
        gallery.add([], [Failure("/prints/1_1.tif", "blank"), Failure("/prints/x.tif", "torn")])
        gallery.add([], [Failure("/prints/x.tif", "still torn")])
        assert [f.reason for f in gallery.failures()] == ["blank", "still torn"]
        gallery.add([entry_of(1)])
        assert gallery.failures() == [Failure("/prints/x.tif", "still torn")]
        assert (gallery.clear_failures(), gallery.clear_failures()) == (1, 0)


def test_removed_numbers_are_not_given_again_and_changes_change_the_hash(where):
    with open_gallery(where, create=True) as gallery:
        hashes = [gallery.content_hash()]
        gallery.add([entry_of(1), entry_of(2)])
        hashes.append(gallery.content_hash())
        first, last = gallery.entries()
        gallery.add([], [Failure("x", "y")])
        assert gallery.add([entry_of(1, source="/elsewhere/1_1.tif")]) == [ENROLLED]
        refused(gallery.remove, [last.id, 999], code="unknown")
        with pytest.raises(GalleryError):
            gallery.remove([10**30])
        assert gallery.content_hash() == hashes[-1]
        assert list(gallery.entries()) == [first, last]
        assert gallery.remove([last.id, last.id]) == 1
        hashes.append(gallery.content_hash())
        refused(gallery.entry, last.id, code="unknown")
        gallery.add([entry_of(2)])
        hashes.append(gallery.content_hash())
        kept, again = gallery.entries()
        assert kept == first
        assert again.id > last.id
        assert len(set(hashes)) == 4


ENROL = """
import sys
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.store.rows import new_entry
from fpmatch.gallery.gallery import open_gallery
from fpmatch.templates.minutiae import Minutiae, Template
template = Template(Minutiae([1], [2], [3]), 300, 300)
with open_gallery(sys.argv[1], create=True) as gallery:
    for k in range(*map(int, sys.argv[2:])):
        gallery.add([new_entry(Label(str(k)), str(k), k.to_bytes(32, "big"), template)])
"""


@pytest.mark.slow
def test_two_processes_make_and_fill_one_gallery_at_once(where):
    """Their prints overlap, and one of them makes the gallery first."""
    writers = [
        subprocess.Popen([sys.executable, "-c", ENROL, where, *map(str, span)])
        for span in ((0, 20), (10, 30))
    ]
    assert [writer.wait(timeout=60) for writer in writers] == [0, 0]
    with open_gallery(where) as gallery:
        entries = list(gallery.entries())
    assert sorted(int(entry.label.subject) for entry in entries) == list(range(30))
    assert len({entry.id for entry in entries}) == 30


def test_nothing_is_made_unless_asked_and_no_other_version_is_opened(where):
    refused(open_gallery, where, code="missing")
    open_gallery(where, create=True).close()
    with closing(Database(where)) as database:
        for version in (1, 2, 5):
            with database.changing() as connection:
                connection.execute(tables.GALLERY.update().values(version=version))
            refused(open_gallery, where, create=True, code="version")
        with database.changing() as connection:
            connection.execute(tables.GALLERY.delete())
        refused(open_gallery, where, code="damaged")


def test_what_is_held_for_longer_than_one_has_patience_is_late(where):
    open_gallery(where, create=True).close()
    with open_gallery(where) as other, open_gallery(where, patience=0.2) as gallery:
        with other.changing():
            begin = time.monotonic()
            error = refused(gallery.add, [entry_of(1)], code="late")
            assert time.monotonic() - begin < 5
            assert str(error).endswith("for more than 0.2 seconds")
        assert gallery.add([entry_of(1)]) == [None]


class TestSqlite:
    """What can be wrong with a file."""

    @pytest.fixture
    def path(self, tmp_path):
        path = tmp_path / "gallery.db"
        with open_gallery(path, create=True) as gallery:
            gallery.add([entry_of(k) for k in range(60)])
        return path

    def test_path_may_hold_what_urls_may_not(self, tmp_path):
        path = tmp_path / "what? 100% #1.db"
        open_gallery(path, create=True).close()
        assert [file.name for file in tmp_path.iterdir()] == [path.name]

    @pytest.mark.parametrize("create", [False, True])
    def test_what_is_no_gallery_is_refused_and_left_alone(self, tmp_path, create):
        (tmp_path / "folder").mkdir()
        (tmp_path / "text").write_text("This is not a gallery, and longer than a header.\n")
        changed(tmp_path / "other", "CREATE TABLE mine (x)")
        os.mkfifo(tmp_path / "pipe")
        for name in ("folder", "text", "other", "pipe"):
            file = tmp_path / name
            before = file.read_bytes() if file.is_file() else b""
            error = refused(open_gallery, file, create=create, code="no gallery")
            assert error.path == str(file)
            assert not file.is_file() or file.read_bytes() == before
        missing = tmp_path / "nowhere" / "gallery.db"
        refused(open_gallery, missing, create=True, code="missing folder")
        (tmp_path / "empty").touch()  # by a program that was killed while it made one
        refused(open_gallery, tmp_path / "empty", code="no gallery")
        open_gallery(tmp_path / "empty", create=True).close()

    @pytest.mark.parametrize("kind", ["cut", "overwritten"])
    def test_damage_is_an_error_of_one_line_or_harmless(self, path, rng, kind):
        with open_gallery(path) as gallery:
            whole = {data for _, data in gallery.packed_templates()}
        original = path.read_bytes()
        reasons, skipped = [], {}
        for _ in range(30):
            damaged = bytearray(original)
            place = int(rng.integers(16, len(original)))
            if kind == "cut":
                del damaged[place:]
            else:
                damaged[place : place + 40] = rng.bytes(len(damaged[place : place + 40]))
            path.write_bytes(damaged)
            try:
                with open_gallery(path) as gallery:
                    list(gallery.entries())
                    list(gallery.templates())
                    assert {data for _, data in gallery.packed_templates()} <= whole
                    skipped |= gallery.damaged
            except GalleryError as error:
                reasons.append(str(error))
        assert reasons or skipped
        for reason in reasons:
            assert reason.startswith(f"{path}: ")
            assert "\n" not in reason

    def test_a_full_disk_is_said_and_loses_nothing(self, path, monkeypatch):
        pages = path.stat().st_size // 4096 + 1
        connect = sqlite3.connect

        def small(*args, **kwargs):
            connection = connect(*args, **kwargs)
            connection.execute(f"PRAGMA max_page_count = {pages}")
            return connection

        monkeypatch.setattr(sqlite3, "connect", small)
        with open_gallery(path) as gallery:
            with pytest.raises(GalleryError, match=r"gallery\.db: the disk is full$"):
                list(map(gallery.add, ([entry_of(k)] for k in range(100, 200))))
            count = len(gallery)
            assert 60 <= count < 160
            assert sum(1 for _ in gallery.templates()) == count

    def test_a_file_that_may_only_be_read_is_read(self, path, monkeypatch):
        connect = sqlite3.connect
        monkeypatch.setattr(
            sqlite3, "connect", lambda name, **rest: connect(name.replace("=rw", "=ro"), **rest)
        )
        with open_gallery(path) as gallery:
            assert sum(1 for _ in gallery.templates()) == 60
            with pytest.raises(GalleryError, match="cannot be written: it, or its folder, is read"):
                gallery.add([entry_of(100)])


def test_an_interrupt_while_a_connection_closes_is_raised_and_not_logged(
    gallery, monkeypatch, caplog
):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(DefaultDialect, "do_close", interrupt)
    with pytest.raises(KeyboardInterrupt), gallery.reading():
        pass
    assert not caplog.records


@pytest.mark.parametrize(
    ("url", "reason"),
    [
        ("sqlite:///a.db", "sqlite:///a.db: galleries are SQLite files or PostgreSQL databases"),
        ("http://me:secret@host/", r"http://me:\*\*\*@host/: galleries are SQLite files or"),
        ("postgresql://host:port/db", "not a URL of the form"),
    ],
)
def test_urls_of_no_gallery(url, reason):
    with pytest.raises(GalleryError, match=reason):
        open_gallery(url)


def test_a_server_that_does_not_answer_is_one_line_without_the_password():
    pytest.importorskip("psycopg")
    url = "postgresql://me:secret@127.0.0.1:1/prints?sslpassword=secret"
    words = str(refused(open_gallery, url, code="database"))
    assert words.startswith("postgresql://me:***@127.0.0.1:1/prints: ")
    assert "refused" in words
    assert "secret" not in words


@pytest.mark.slow
@pytest.mark.parametrize("where", ["postgresql"], indirect=True)
def test_a_lost_connection_is_one_line_and_is_made_anew(where):
    import psycopg

    others = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = %s"

    def end_all(*_, **__):
        with psycopg.connect(where.replace(name, "postgres"), autocommit=True) as server:
            server.execute(others, [name])

    name = where.rpartition("/")[2]
    with open_gallery(where, create=True) as gallery:
        gallery.add([entry_of(1)])
        end_all()
        assert gallery.add([entry_of(2)]) == [None]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(gallery_module.Gallery, "_mark_changed", end_all)
            refused(gallery.add, [entry_of(3)], code="database")
        assert gallery.add([entry_of(3)]) == [None]
        assert len(gallery) == 3


@pytest.mark.slow
@pytest.mark.parametrize("where", ["postgresql"], indirect=True)
def test_a_server_that_is_stopped_is_late(where):
    import psycopg

    open_gallery(where, create=True).close()
    with psycopg.connect(where) as connection:
        (folder,) = connection.execute("SHOW data_directory").fetchone()
    server = int(Path(folder, "postmaster.pid").read_text().split()[0])
    os.kill(server, signal.SIGSTOP)
    try:
        begin = time.monotonic()
        refused(open_gallery, where, patience=2, code="late")
        assert time.monotonic() - begin < 10
    finally:
        os.kill(server, signal.SIGCONT)


def test_no_query_of_an_enrolment_scans_the_entries(tmp_path):
    """Enrolment takes no longer in a large gallery: SQLite finds all it asks for by an index."""
    asked = []

    def keep(connection, cursor, statement, parameters, context, executemany):
        if statement.startswith("SELECT") and "fpmatch_entry" in statement:
            asked.append((statement, parameters))

    with open_gallery(tmp_path / "prints.db", create=True) as gallery:
        sa.event.listen(sa.Engine, "before_cursor_execute", keep)
        try:
            gallery.add([entry_of(k) for k in range(5)])
            request = EnrolmentRequest(entry_of(9).label, bytes([99] * 32))
            assert gallery.find_conflicts([request]) == [None]
        finally:
            sa.event.remove(sa.Engine, "before_cursor_execute", keep)
    assert asked
    with closing(sqlite3.connect(tmp_path / "prints.db")) as connection:
        for statement, parameters in asked:
            plan = connection.execute(f"EXPLAIN QUERY PLAN {statement}", parameters).fetchall()
            assert not [row for row in plan if "SCAN fpmatch_entry" in row[3]], statement
