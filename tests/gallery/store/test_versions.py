"""Galleries that version 0.2 made, as SQL, are read, changed, searched and encrypted anew."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from made_prints import entry_of, readable

from fpmatch.gallery.encryption.keys import Key, KeyRing
from fpmatch.gallery.gallery import open_gallery, rotate
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.search import Search
from fpmatch.gallery.store.audit import check_audit, events_of

HERE = Path(__file__).parent
KEYS = KeyRing([Key(bytes(range(32)))])


@pytest.mark.parametrize("version", [3, 4])
def test_a_gallery_of_version_0_2_is_whole_and_can_be_changed(tmp_path, version):
    path = tmp_path / "g.db"
    with closing(sqlite3.connect(path)) as database:
        database.executescript((HERE / f"version_{version}.sql").read_text())
    with open_gallery(path, key=KEYS) as gallery:
        counted = gallery.summarize()
        names = ("version", "impressions", "failures")
        assert [counted[name] for name in names] == [version, 2, 1]
        assert counted["keys"] == (list(KEYS.ids) if version == 4 else [])
        assert [entry.id for entry in gallery.entries()] == [1, 3]
        templates = dict(gallery.templates())
        assert [one.minutiae.x.tolist() for one in templates.values()] == [
            [10, 20, 30],
            [30, 20, 30],
        ]
        assert templates[1].field.ridges.tolist() == [[0, 1], [2, 3]]
        assert identify(Search(gallery), templates[3]).candidates[0].number == 3
        gallery.check_rows()
        assert gallery.damaged == {}
        assert check_audit(gallery)[0] == 3
        assert gallery.add([entry_of(7)]) == [None]
        gallery.remove([1])
        assert check_audit(gallery)[0] == 5
        rotate(gallery)
        assert dict(gallery.templates())[3] == templates[3]
        assert [entry.id for entry in gallery.entries()] == [3, 4]
        assert [event["action"] for _, _, event in events_of(gallery)][-1] == "rotate keys"
    assert not readable(tmp_path, templates[3])
