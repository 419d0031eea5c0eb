"""Targets: the list and the segments of a gallery's index, with the searches of them.

Byte by byte damage must be noticed: the candidates are the same to the last bit. Where checksums
were corrected, other candidates are right; the search must only end well.
"""

from __future__ import annotations

import os
import shutil
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.gallery.gallery import open_gallery
from research.fuzzing.mutators.containers import ARRAYS
from research.fuzzing.targets.stores import RESULTS, candidates, gallery_file
from research.fuzzing.targets.target import Reader, Target, scratch

if TYPE_CHECKING:
    from pathlib import Path


def index_targets() -> list[Target]:
    """Return the targets of both kinds of files, damaged and forged."""
    given: dict[str, Any] = {"group": "stores", "kernels": True}
    return [
        Target("index-list", lambda: _index("index", strict=True), **given),
        Target("index-list-forged", lambda: _index("index", strict=False), ARRAYS, **given),
        Target("index-segment", lambda: _index("segment", strict=True), **given),
        Target("index-segment-forged", lambda: _index("segment", strict=False), ARRAYS, **given),
    ]


def _index(kind: str, *, strict: bool) -> Reader:
    good = _good(os.getpid())
    with open_gallery(_copy(os.getpid())) as gallery:
        expected, _ = candidates(gallery, indexed=True)
    (damaged,) = (path for path in good if path.suffix == f".{kind}")

    def read(data: bytes) -> list[str]:
        place = _copy(os.getpid())
        beside = place.with_name(f"{place.name}.prepared")
        shutil.rmtree(beside, ignore_errors=True)
        beside.mkdir()
        for path, content in good.items():
            (beside / path.name).write_bytes(data if path == damaged else content)
        with open_gallery(place) as gallery:
            found, notes = candidates(gallery, indexed=True)
        if strict and found != expected:
            raise AssertionError(RESULTS)
        if not np.isfinite([one[2:] for one in found]).all():
            raise AssertionError("candidates without a score")
        return notes

    return Reader([good[damaged]], read)


@cache
def _copy(pid: int) -> Path:
    """Return a copy of the gallery for a process."""
    path = scratch() / f"indexed {pid}" / "prints.db"
    path.parent.mkdir()
    shutil.copyfile(gallery_file(), path)
    return path


@cache
def _good(pid: int) -> dict[Path, bytes]:
    """Return the files of the index, and their contents."""
    place = _copy(pid)
    with open_gallery(place) as gallery:
        candidates(gallery, indexed=True)
    beside = place.with_name(f"{place.name}.prepared")
    return {path: path.read_bytes() for path in sorted(beside.iterdir())}
