"""Targets: galleries, their prepared files, and runs that are resumed, with the searches of them.

Byte by byte damage must be noticed: the candidates are the same to the last bit, or there is an
error or a note. Where values were changed through SQLite, or checksums were corrected, other
candidates are right; the search must only end well. In an encrypted gallery entries can then be
missing, but none has another name.
"""

from __future__ import annotations

import hashlib
import os
import random
import secrets
import shutil
import sqlite3
import zlib
from contextlib import closing, suppress
from functools import cache
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

import numpy as np

from fpmatch.gallery.batch.plan import AllPairs
from fpmatch.gallery.batch.score import score
from fpmatch.gallery.batch.sources import pack, unpack
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index.prepared import load_prepared
from fpmatch.gallery.index.prints.compact_template import (
    CompactTemplates,
    compact,
    expand,
    prepare_compact,
)
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.gallery.index.prints.stored_descriptors import COLUMNS, StoredDescriptors
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.store.array_file import read_arrays, write_arrays
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.matching.prints.prepare import prepare
from fpmatch.matching.registry import get_matcher
from fpmatch.printable import printable
from research.fuzzing.mutators.containers import ARRAYS, SQLITE, zip_member
from research.fuzzing.mutators.records import stored_template, use_key
from research.fuzzing.targets.tables import SAMPLES
from research.fuzzing.targets.target import Reader, Target, scratch, written

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.templates.minutiae import Template

PRINTS = ("101_1", "101_2", "102_1", "103_1")
PROBE = "101_3"
RENEWED_ONE_IN = 30  # of the prepared files that are refused: that takes longer
MINUTIAE = 16  # of each print: fewer are compared faster
RESULTS = "other candidates than before the damage, without an error or a note"


def store_targets() -> list[Target]:
    """Return the targets of galleries, prepared files and unfinished runs."""
    stores: dict[str, Any] = {"group": "stores", "kernels": True}
    return [
        Target("gallery", lambda: _gallery(strict=True), **stores),
        Target("gallery-cells", lambda: _gallery(strict=False), SQLITE, **stores),
        Target("gallery-sealed", lambda: _gallery(strict=False, encrypt=True), SQLITE, **stores),
        Target("prepared", lambda: _prepared(strict=True), **stores),
        Target("prepared-forged", lambda: _prepared(strict=False), ARRAYS, **stores),
        Target("packed-template", _packed, (stored_template,), kernels=True),
        Target("compact-template", _compact, (stored_template,), kernels=True),
        Target("packed-descriptors", _descriptors, ARRAYS, kernels=True),
        Target("stored-template", _stored, (zip_member,), kernels=True),
        Target("unfinished-run", _unfinished, SQLITE),
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
    """Return a gallery of the prints, with its prepared files beside it."""
    return _made_gallery(encrypt)


@cache
def _made_gallery(encrypt: bool) -> Path:
    use_key()
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
        open_search(gallery, engine=serial())
    return path


def _entry(name: str, template: Template) -> NewEntry:
    subject, _, impression = name.partition("_")
    digest = hashlib.sha256(name.encode()).digest()
    return NewEntry(Label(subject, "", impression), f"{name}.tif", digest, template)


def _candidates(
    gallery: Gallery, *, impressions: bool = False
) -> tuple[list[tuple[Any, ...]], list[str]]:
    """Return the candidates of the probe in a gallery, as a search states them, and notes."""
    notes: list[str] = []
    search = open_search(gallery, engine=serial(), note=notes.append)
    found = identify(
        search, templates()[PROBE], count=10, listed="impressions" if impressions else "fingers"
    )
    notes += [f"entry {number}: {why}" for number, why in gallery.damaged.items()]
    label = {entry.id: str(entry.label) for entry in gallery.entries()}
    return [
        (label.get(one.number), one.number, one.similarity, one.score, one.impressions)
        for one in found.candidates
    ], notes


def _gallery(*, strict: bool, encrypt: bool = False) -> Reader:
    made = gallery_file(encrypt=encrypt)
    with open_gallery(made) as gallery:
        expected, _ = _candidates(gallery)
        single = {(one[0], one[2]) for one in _candidates(gallery, impressions=True)[0]}

    def read(data: bytes) -> list[str]:
        path = scratch() / "prints.db"
        path.write_bytes(data)
        try:
            with open_gallery(path) as gallery:
                found, notes = _candidates(gallery)
                gallery.summary()
                shown = [f"{entry.label} {entry.source}" for entry in gallery.entries()]
                shown += [failure.reason for failure in gallery.failures()]
        finally:
            for leftover in path.parent.glob("prints.db*"):
                shutil.rmtree(leftover) if leftover.is_dir() else leftover.unlink()
        if strict and found != expected and not notes:
            raise AssertionError(RESULTS)
        if encrypt and not {(one[0], one[2]) for one in found} <= single:
            raise AssertionError("a template under another name, without an error or a note")
        return [*map(printable, shown), *notes]

    return Reader([made.read_bytes()], read)


def _prepared(*, strict: bool) -> Reader:
    """Damage the prepared file of a gallery, and search with it, or with what replaces it."""
    made = gallery_file()
    with open_gallery(made) as gallery:
        expected, _ = _candidates(gallery)
    matcher = get_matcher("unit-circle")
    (good,) = made.with_name(f"{made.name}.prepared").iterdir()

    def read(data: bytes) -> list[str]:
        gallery = _own_copy(os.getpid())
        beside = scratch() / "copy" / "prints.db.prepared"
        for one in beside.iterdir():
            one.unlink()
        path = beside / good.name
        path.write_bytes(data)
        if zlib.crc32(data) % RENEWED_ONE_IN:
            load_prepared(path, matcher)
        found, notes = _candidates(gallery)
        if strict and found != expected:
            raise AssertionError(RESULTS)
        if not np.isfinite([one[2:] for one in found]).all():
            raise AssertionError("candidates without a score")
        return notes

    return Reader([good.read_bytes()], read)


@cache
def _own_copy(pid: int) -> Gallery:
    """Return the open copy of the gallery of this process."""
    path = scratch() / "copy" / "prints.db"
    path.with_name(f"{path.name}.prepared").mkdir(parents=True)
    shutil.copyfile(gallery_file(), path)
    return open_gallery(path)


def _compare(template: Template) -> None:
    """Prepare a template and compare it with a good one, both ways."""
    matcher = get_matcher("unit-circle")
    one, other = matcher.prepare(template), matcher.prepare(templates()[PROBE])
    found = [matcher.compare(*pair).similarity for pair in ((one, other), (other, one))]
    if not np.isfinite(found).all():
        raise AssertionError(f"similarities {found}")


def _packed() -> Reader:
    def read(data: bytes) -> None:
        template = unpack_template(data)
        pack_template(template)
        _compare(template)

    return Reader([pack_template(template) for template in templates().values()], read)


def _compact() -> Reader:
    good = compact(templates()[PROBE])

    def read(data: bytes) -> None:
        among = prepare_compact(CompactTemplates.of_bytes([good, data]), np.arange(2))
        template = expand(data)
        alone = PreparedPrints.pack([prepare(expand(good)), prepare(template)])
        if any(getattr(among, k).tobytes() != a.tobytes() for k, a in alone.arrays().items()):
            raise AssertionError("another print among others than alone")
        if compact(expand(compact(template))) != compact(template):
            raise AssertionError("an expanded template gives other bytes")
        _compare(template)

    return Reader([compact(template) for template in templates().values()], read)


def _descriptors() -> Reader:
    prints = [prepare(template) for template in templates().values()]
    path = scratch() / "descriptors"
    write_arrays(path, StoredDescriptors.pack(prints).arrays(), COLUMNS, {})

    def read(data: bytes) -> None:
        loaded = StoredDescriptors.of_arrays(read_arrays(written("read", data), COLUMNS, {}))
        if (loaded.scores(prints[0]) < 0).any():
            raise AssertionError("a negative score")
        for k in range(len(loaded)):
            loaded[k]

    return Reader([path.read_bytes()], read)


def _stored() -> Reader:
    def read(data: bytes) -> None:
        _compare(unpack(data))

    return Reader([pack(template) for template in templates().values()], read)


class _StopError(Exception):
    """A run is to be interrupted."""


def _unfinished() -> Reader:
    """Damage the state of an interrupted run, and resume it."""
    made, output = gallery_file(), scratch() / "scores.csv"
    plan = AllPairs(len(PRINTS), len(PRINTS), band=2, pairs_per_chunk=4)

    def stop(stage: str, done: int, total: int) -> None:
        if stage == "compare" and 0 < done < total:
            raise _StopError

    state = output.with_name("scores.csv.unfinished")
    with suppress(_StopError), patch("fpmatch.gallery.batch.resumed_rows.SAVE_EVERY_S", 0):
        score(made, made, output, pairs=plan, progress=stop)
    rows = (state / "rows.csv").read_bytes()
    with closing(sqlite3.connect(state / "state.db")) as database:
        database.execute("VACUUM")
    data = (state / "state.db").read_bytes()

    def read(data: bytes) -> list[str]:
        own = scratch() / "scores.csv"
        folder = own.with_name("scores.csv.unfinished")
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        (folder / "rows.csv").write_bytes(rows)
        (folder / "state.db").write_bytes(data)
        done = score(made, made, own, pairs=plan)
        return [*(one.reason for one in done.failures), *done.dpi_assumed]

    return Reader([data], read)
