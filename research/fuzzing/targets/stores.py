"""Targets: galleries, the files beside them, and runs that are resumed, with the searches of them.

Damage must be noticed: the candidates are the same to the last bit, or there is an error or a note.
"""

from __future__ import annotations

import hashlib
import os
import random
import secrets
import shutil
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Literal, get_args
from unittest.mock import patch

import numpy as np

from fpmatch.gallery.batch.sources import pack, unpack
from fpmatch.gallery.encryption.keys import KEY_VARIABLE, Key
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.search import Search
from fpmatch.gallery.store.rows import new_entry
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.matching.registry import get_matcher
from fpmatch.printable import printable
from research.fuzzing.damage import with_right_sum
from research.fuzzing.target import SAMPLES, Reader, Target, scratch

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.templates.minutiae import Template

PRINTS = ("101_1", "101_2", "102_1", "103_1")
PROBE = "101_3"
MINUTIAE = 16  # of each print: fewer are compared faster
Kept = Literal["", "index"]  # files of a gallery from before the damage
RESULTS = "other candidates than before the damage, without an error or a note"


def store_targets() -> list[Target]:
    """Return the targets of galleries and their indices."""
    return [
        *(
            Target(
                f"gallery{'-sealed' * encrypt}{'-' * bool(kept)}{kept}",
                partial(_gallery, kept, encrypt=encrypt),
                kernels=True,
            )
            for encrypt in (False, True)
            for kept in get_args(Kept)
        ),
        Target("index-segment", _index, kernels=True),
        Target("packed-template", _packed, kernels=True),
        Target("stored-template", _stored, kernels=True),
    ]


@cache
def templates() -> dict[str, Template]:
    """Return small templates of the sample prints, with ridges."""
    found = {}
    for name in (*PRINTS, PROBE):
        image = read_image(SAMPLES / f"{name}.tif")
        whole = extract(image, image.dpi or 500.0)
        best = np.sort(np.argsort(-whole.minutiae.quality.astype(int), kind="stable")[:MINUTIAE])
        found[name] = type(whole)(
            whole.minutiae.take(best), whole.width, whole.height, whole.dpi, whole.field
        )
    return found


def gallery_file(*, encrypt: bool = False) -> Path:
    """Return a gallery of the prints."""
    return _made_gallery(encrypt)


@cache
def _made_gallery(encrypt: bool) -> Path:
    # always the same key: a finding is replayed with it
    keys = scratch() / "keys.txt"
    keys.touch(0o600)
    keys.write_text(Key(bytes(range(32))).as_line())
    os.environ[KEY_VARIABLE] = f"file:{keys}"
    path = scratch() / ("sealed" if encrypt else "made") / "prints.db"
    path.parent.mkdir()
    new = [_entry(name, template) for name, template in templates().items() if name != PROBE]
    seeded = random.Random(0)
    with (
        patch.object(secrets, "token_hex", lambda size=32: seeded.randbytes(size).hex()),
        patch.object(os, "urandom", seeded.randbytes),
        open_gallery(path, create=True, encrypt=encrypt) as gallery,
    ):
        gallery.add(new)
    return path


def _entry(name: str, template: Template) -> NewEntry:
    subject, _, impression = name.partition("_")
    digest = hashlib.sha256(name.encode()).digest()
    return new_entry(Label(subject, "", impression), f"{name}.tif", digest, template)


def candidates(
    gallery: Gallery, *, indexed: bool = False
) -> tuple[list[tuple[Any, ...]], list[str]]:
    """Return the candidates of the probe in a gallery, as a search states them, and notes."""
    notes: list[str] = []
    most = 0 if indexed else len(gallery)
    with patch("fpmatch.gallery.search.search.EXHAUSTIVE_UP_TO", most):
        search = Search(gallery, engine=serial(), note=notes.append)
    found = identify(search, templates()[PROBE], count=10)
    notes += [f"entry {number}: {why}" for number, why in gallery.damaged.items()]
    return [
        (str(entry.label), entry.source, one.number, one.similarity, one.score, one.impressions)
        for one, entry in zip(found.candidates, found.entries, strict=True)
    ], notes


def _gallery(kept: Kept, *, encrypt: bool = False) -> Reader:
    """Damage the file of a gallery, and search it with the files that were kept of it before."""
    made, search = gallery_file(encrypt=encrypt), partial(candidates, indexed=kept == "index")
    place = scratch() / f"{kept} {encrypt}" / "prints.db"
    place.parent.mkdir(exist_ok=True)
    shutil.copyfile(made, place)
    with open_gallery(place) as gallery:
        expected, _ = search(gallery)
        single = {
            (str(gallery.entry(number).label), _compare(template))
            for number, template in gallery.templates()
        }
    beside = place.with_name("prints.db.prepared")
    files = {one.name: one.read_bytes() for one in beside.iterdir()} if kept else {}

    def read(data: bytes) -> list[str]:
        path = scratch() / "prints.db"
        path.write_bytes(data)
        own = path.with_name("prints.db.prepared")
        own.mkdir()
        for name, content in files.items():
            (own / name).write_bytes(content)
        try:
            with open_gallery(path) as gallery:
                found, notes = search(gallery)
                if found != expected and not notes:
                    raise AssertionError(RESULTS)
                if not {(one[0], one[3]) for one in found} <= single:
                    raise AssertionError("a template under another name")
                gallery.summarize()
                shown = [f"{entry.label} {entry.source}" for entry in gallery.entries()]
                shown += [failure.reason for failure in gallery.failures()]
        finally:
            for leftover in path.parent.glob("prints.db*"):
                shutil.rmtree(leftover) if leftover.is_dir() else leftover.unlink()
        return [*map(printable, shown), *notes]

    return Reader([made.read_bytes()], read)


def _compare(template: Template) -> float:
    """Return the similarity of a template and a good one, which are compared both ways."""
    matcher = get_matcher("unit-circle")
    one, other = matcher.prepare(template), matcher.prepare(templates()[PROBE])
    found = [matcher.compare(*pair).similarity for pair in ((one, other), (other, one))]
    if not np.isfinite(found).all():
        raise AssertionError(f"similarities {found}")
    return found[1]


def _packed() -> Reader:
    def read(data: bytes) -> None:
        template = unpack_template(data)
        pack_template(template)
        _compare(template)

    packed = [pack_template(template) for template in templates().values()]
    return Reader(packed, read, with_right_sum)


def _index() -> Reader:
    """Damage a file of a gallery's index, and search with it, or with what replaces it."""
    place = scratch() / "indexed" / "prints.db"
    place.parent.mkdir()
    shutil.copyfile(gallery_file(), place)
    with open_gallery(place) as gallery:
        expected, _ = candidates(gallery, indexed=True)
    beside = place.with_name(f"{place.name}.prepared")
    good = {path.name: path.read_bytes() for path in sorted(beside.iterdir())}
    (damaged,) = (name for name in good if name.endswith(".segment"))

    def read(data: bytes) -> list[str]:
        shutil.rmtree(beside, ignore_errors=True)
        beside.mkdir()
        for name, content in good.items():
            (beside / name).write_bytes(data if name == damaged else content)
        with open_gallery(place) as gallery:
            found, notes = candidates(gallery, indexed=True)
        if found != expected:
            raise AssertionError(RESULTS)
        return notes

    return Reader([good[damaged]], read)


def _stored() -> Reader:
    def read(data: bytes) -> None:
        _compare(unpack(data))

    return Reader([pack(template) for template in templates().values()], read)
