"""A folder is locked against others, by itself or by a file beside it."""

import pytest

from fpmatch.gallery.engine import folder_lock as module
from fpmatch.gallery.engine.folder_lock import folder_lock


@pytest.fixture(params=["folder", "file beside it"])
def kind(request, monkeypatch):
    if request.param != "folder":
        monkeypatch.setattr(module, "find_spec", lambda name: None)
    return request.param


def test_a_lock_keeps_others_out_until_it_is_released(tmp_path, kind):
    folder = tmp_path / "kept"
    folder.mkdir()
    with folder_lock(folder), pytest.raises(BlockingIOError), folder_lock(folder, wait=False):
        pass
    with folder_lock(folder, wait=False):
        assert not list(folder.iterdir())
    with pytest.raises(ZeroDivisionError), folder_lock(folder):
        _ = 1 / 0
    with folder_lock(folder, wait=False):
        pass


def test_a_folder_that_is_missing_cannot_be_locked(tmp_path, kind):
    with pytest.raises(FileNotFoundError), folder_lock(tmp_path / "missing"):
        pass
    assert not list(tmp_path.iterdir())
