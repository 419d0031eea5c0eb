"""A transaction on the database of a gallery, and what a user sees of its failures."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import pytest
from sqlalchemy.engine.default import DefaultDialect

from fpmatch.gallery.store.database import Database

if TYPE_CHECKING:
    from pathlib import Path


def _interrupted(*_: object) -> NoReturn:
    raise KeyboardInterrupt


def test_an_interrupt_while_a_connection_closes_is_raised_and_not_logged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    database = Database(tmp_path / "prints.db", create=True)
    monkeypatch.setattr(DefaultDialect, "do_close", _interrupted)
    with pytest.raises(KeyboardInterrupt), database.reading():
        pass
    assert not caplog.records
