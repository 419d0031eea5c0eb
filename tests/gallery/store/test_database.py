"""A transaction on the database of a gallery, and what a user sees of its failures."""

import os

import pytest
from sqlalchemy.engine.default import DefaultDialect

from fpmatch import open_gallery
from fpmatch.errors import GalleryError
from fpmatch.gallery.store.database import Database


def _interrupted(*_):
    raise KeyboardInterrupt


def test_an_interrupt_while_a_connection_closes_is_raised_and_not_logged(
    tmp_path, monkeypatch, caplog
):
    database = Database(tmp_path / "prints.db", create=True)
    monkeypatch.setattr(DefaultDialect, "do_close", _interrupted)
    with pytest.raises(KeyboardInterrupt), database.reading():
        pass
    assert not caplog.records


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(GalleryError, match="pipe: is not a regular file, not a gallery"):
        open_gallery(tmp_path / "pipe")
