"""What is kept of prints may be read by its owner only, whatever the umask."""

import os
import stat

import pytest
from made_prints import entry_of

from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.search.search import Search
from fpmatch.matching.constants import COMPILED

pytestmark = pytest.mark.skipif(os.name == "nt", reason="rights are those of the folder there")


@pytest.fixture(params=[0, 0o022, 0o777], autouse=True)
def _umask(request, tmp_path):
    before = os.umask(request.param)
    yield
    os.umask(before)


def rights(folder):
    """Return the rights of everything below a folder."""
    return {path: stat.S_IMODE(path.stat().st_mode) for path in folder.rglob("*")}


def assert_private(folder, number):
    assert len(rights(folder)) >= number
    for path, mode in rights(folder).items():
        assert mode == (0o700 if path.is_dir() else 0o600), (path, oct(mode))


@pytest.mark.skipif(not COMPILED, reason="an index needs compiled kernels")
def test_galleries_their_journals_and_indices(tmp_path, monkeypatch):
    monkeypatch.setattr("fpmatch.gallery.search.search.EXHAUSTIVE_UP_TO", 2)
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        gallery.add([entry_of(k) for k in range(3)])
        Search(gallery, engine=serial())
        with gallery.changing() as connection:
            connection.exec_driver_sql("DELETE FROM fpmatch_failure")
            connection.exec_driver_sql("UPDATE fpmatch_entry SET source = 'x'")
            assert (tmp_path / "g.db-journal").exists()
            assert_private(tmp_path, 4)
