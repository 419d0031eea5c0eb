"""A database that is held, or that is silent: every call of it ends in time, with one line."""

import socket
import time
from contextlib import closing

import pytest
import sqlalchemy as sa

from fpmatch.errors import GalleryError
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.tasks.space import free_space
from tests.gallery.store.hanging import HangingDatabase, HangingFile

PATIENCE_S = 0.3
LONGEST_S = 4.0  # of a call: the connection is tried, then made anew, for two seconds at least


def refusal(work):
    """Return the line of the error of a call that was waited for in vain."""
    start = time.monotonic()
    with pytest.raises(GalleryError) as caught:
        work()
    assert time.monotonic() - start < LONGEST_S
    assert caught.value.code == "late"
    return str(caught.value)


def test_a_file_that_another_program_holds_is_waited_for_no_longer(tmp_path):
    place = HangingFile(tmp_path / "g.db")
    with open_gallery(place.place, create=True, patience=PATIENCE_S) as gallery:
        with place.hangs():
            why = f"another program has held it for more than {PATIENCE_S:g} seconds"
            assert refusal(lambda: list(gallery.entries())) == f"{place.place}: {why}"
            assert why in refusal(lambda: gallery.remove([1]))
            assert why in refusal(lambda: open_gallery(place.place, patience=PATIENCE_S))
        assert list(gallery.entries()) == []


@pytest.mark.slow
def test_a_server_that_says_nothing_is_waited_for_no_longer():
    pytest.importorskip("psycopg", reason="psycopg is not installed (fpmatch[postgres])")
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"postgresql://ada:secret@127.0.0.1:{silent.getsockname()[1]}/prints"
        line = refusal(lambda: open_gallery(url, patience=2))
    assert line == f"{url.replace('secret', '***')}: no answer for more than 2 seconds"


def statement(gallery, text):
    with gallery.writing() as connection:
        connection.execute(sa.text("SELECT 1"))
        connection.execute(sa.text(text))


@pytest.mark.slow
@pytest.mark.parametrize("where", ["postgresql"], indirect=True)
def test_a_server_that_falls_silent_ends_every_call_and_then_goes_on(where):
    with (
        closing(HangingDatabase(where)) as database,
        open_gallery(database.place, create=True, patience=PATIENCE_S) as gallery,
    ):
        with database.hangs():
            for work in (
                lambda: list(gallery.entries()),
                lambda: gallery.remove([1]),
                gallery.summary,
                lambda: open_gallery(database.place, patience=PATIENCE_S),
            ):
                assert "no answer for more than" in refusal(work)
        assert list(gallery.entries()) == []
        refusal(lambda: statement(gallery, "SELECT pg_sleep(1)"))
        statement(gallery, "SELECT pg_sleep(0.01)")
        free_space(gallery)
