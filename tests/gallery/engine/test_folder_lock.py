"""A folder is locked against others, by itself or by a file beside it."""

import pytest

from fpmatch.gallery.engine import folder_lock as module
from fpmatch.gallery.engine.folder_lock import folder_lock


@pytest.mark.parametrize("itself", [True, False])
def test_a_lock_keeps_others_out_until_it_is_released(tmp_path, monkeypatch, itself):
    folder = tmp_path / "kept"
    if not itself:
        monkeypatch.setattr(module, "find_spec", lambda name: None)
    with pytest.raises(FileNotFoundError), folder_lock(folder):
        pass
    assert not list(tmp_path.iterdir())
    folder.mkdir()
    for _ in range(2):
        with folder_lock(folder), pytest.raises(BlockingIOError), folder_lock(folder, wait=False):
            pass
    assert not list(folder.iterdir())
