from __future__ import annotations

import cv2
import numpy as np
import pytest

from fpmatch.drawing.files import png_bytes, write_whole
from fpmatch.errors import OutputError


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (5, 7, 4)])
def test_png_keeps_every_pixel(rng, shape):
    picture = rng.integers(0, 256, shape, dtype=np.uint8)
    stored = cv2.imdecode(np.frombuffer(png_bytes(picture), np.uint8), cv2.IMREAD_UNCHANGED)
    order = {2: [slice(None)], 3: [[2, 1, 0]], 4: [[2, 1, 0, 3]]}
    back = stored if len(shape) == 2 else stored[..., order[shape[2]][0]]
    np.testing.assert_array_equal(back, picture)


def test_a_file_is_replaced_and_nothing_left_beside_it(tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    write_whole(path, b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_gets_the_usual_permissions(tmp_path):
    (tmp_path / "plain").write_bytes(b"")
    write_whole(tmp_path / "ours", b"")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("target", ["missing/a.png", "file/a.png", "folder"])
def test_what_cannot_be_written_is_named(tmp_path, target):
    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "folder").mkdir()
    with pytest.raises(OutputError, match=f"{target}: cannot be written: ") as caught:
        write_whole(tmp_path / target, b"content")
    assert "\n" not in str(caught.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]
