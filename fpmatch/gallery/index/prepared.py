"""Prepared prints of a gallery, kept in a file that later searches map into memory.

Where it is, `store.kept_files` states. It is renewed when the gallery or the matcher has changed,
when it is damaged, or another one stands in its place; prints that are in an old, whole file are
copied.
"""

from __future__ import annotations

import hashlib
import secrets
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.base.folders import make_folder, remove_unfinished
from fpmatch.errors import FpmatchError, OutputError
from fpmatch.gallery.engine.engine import processes
from fpmatch.gallery.index.prints import prepared_prints
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.gallery.index.prints.print_arrays import PRINT
from fpmatch.gallery.store.array_file import Column, read_arrays, write_arrays
from fpmatch.gallery.store.kept_files import (
    FAULTS,
    PREPARED,
    STALE_S,
    kept_folders,
    seal_of,
    unseal_of,
)
from fpmatch.gallery.store.stored_template import unpack_template

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.gallery.store.sealing import Sealing
    from fpmatch.matching.result import Matcher

PRINTS_PER_CHUNK: Final = 64
COLUMNS: Final = {
    "number": Column("<i8", (PRINT,)),
    "finger": Column("<i8", (PRINT,)),
    "digest": Column("|u1", (PRINT, 16)),
    **prepared_prints.COLUMNS,
}
"""The arrays of a file."""


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """The prepared prints of a gallery.

    For each, `numbers` holds the number of its entry, ascending, `fingers` the lowest number of an
    entry of its finger, and `digests` the beginning of the SHA-256 of its template, shape (N, 16).
    """

    numbers: NDArray[np.int64]
    fingers: NDArray[np.int64]
    digests: NDArray[np.uint8]
    prints: PreparedPrints

    def digest_list(self) -> list[bytes]:
        """Return the digests."""
        whole = self.digests.tobytes()
        return [whole[k : k + 16] for k in range(0, len(whole), 16)]


def prepare_gallery(
    gallery: GalleryReader,
    matcher: Matcher,
    *,
    engine: Engine | None,
    progress: Progress,
    note: Callable[[str], object],
) -> Prepared:
    """Return the prepared prints of a gallery by number, from a file where it has not changed.

    `progress` is called with stage "prepare" and numbers of prints that are in no file; `note`,
    where a file cannot be used or the database is damaged, with a line on it.
    """
    gallery.check_keys()
    content = gallery.content_hash()
    folders = kept_folders(gallery)
    faults: list[str] = []
    sealing = gallery.sealing()
    read = partial(load_prepared, matcher=matcher, sealing=sealing)
    names = (folder / prepared_name(matcher, content) for folder in folders)
    kept = _first_whole(names, read, faults)
    if kept is not None:
        _find_damaged(gallery, kept)
        return kept
    old = _first_whole(_newest_first(folders, matcher, content), read, faults)
    if faults:
        note(f"prepared prints of {gallery.name} {FAULTS[faults[0]]}: prepared again")
    gallery.check_whole(note)
    prepared = _renew(gallery, matcher, old, engine or processes(), progress)
    name = content
    if gallery.content_hash() != content:
        if not gallery.fingers().keys() >= set(prepared.numbers.tolist()):
            return prepared  # some were removed meanwhile: nothing of them is left in a file
        name = secrets.token_hex(16)  # others may be among them: no content has this name
    for folder in folders:
        with suppress(OutputError):
            path = folder / prepared_name(matcher, name)
            save_prepared(path, prepared, matcher, gallery.sealing())  # which may be new
            _remove_others(path, matcher)
            break
    return prepared


def _find_damaged(gallery: GalleryReader, kept: Prepared) -> None:
    """Add to `gallery.damaged` the entries that are not among its prepared prints."""
    if len(gallery) > len(kept.numbers):
        for number in gallery.fingers().keys() - set(kept.numbers.tolist()):
            gallery.find_template(number)


def load_prepared(path: Path, matcher: Matcher, sealing: Sealing | None = None) -> Prepared:
    """Return the content of a file, whose name states which gallery it is of.

    That of a gallery with `sealing` is decrypted into memory. Raises FpmatchError with the codes of
    `fpmatch.gallery.store.array_file.read_arrays`.
    """
    arrays = read_arrays(path, COLUMNS, _about(path, matcher), unseal=unseal_of(sealing))
    prints = PreparedPrints.of_arrays(arrays)
    numbers, fingers = arrays["number"], arrays["finger"]
    if not ((np.diff(numbers) > 0).all() and (fingers <= numbers).all()):
        raise FpmatchError("damaged", path=path, code="damaged")
    return Prepared(numbers, fingers, arrays["digest"], prints)


def save_prepared(
    path: Path, prepared: Prepared, matcher: Matcher, sealing: Sealing | None = None
) -> None:
    """Write a file that `load_prepared` reads, in a folder that is made where it is missing."""
    make_folder(path.parent, narrow=True)
    arrays = prepared.prints.arrays()
    arrays |= {"number": prepared.numbers, "finger": prepared.fingers, "digest": prepared.digests}
    write_arrays(path, arrays, COLUMNS, _about(path, matcher), seal=seal_of(sealing))


def prepared_name(matcher: Matcher, content: str) -> str:
    """Return the name of the file for a matcher and the content hash of a gallery."""
    return f"{matcher.name}-{__version__}-{content}{PREPARED}"


def _about(path: Path, matcher: Matcher) -> dict[str, str]:
    """Return what a file must be about."""
    how = prepared_prints.preparation()
    return {"name": path.name, "prepared": how, "matcher": matcher.name, "version": __version__}


def _first_whole(
    paths: Iterable[Path], read: Callable[[Path], Prepared], faults: list[str]
) -> Prepared | None:
    """Return the first file that can be used; what is wrong with those before joins `faults`."""
    for path in paths:
        try:
            return read(path)
        except FpmatchError as error:
            if error.code != "missing":
                faults.append(error.code)
    return None


def _newest_first(folders: Sequence[Path], matcher: Matcher, content: str) -> list[Path]:
    """Return the files of every content but one, the one saved last first."""
    saved: list[tuple[float, Path]] = []
    for folder in folders:
        for path in folder.glob(prepared_name(matcher, "*")):
            if path.name != prepared_name(matcher, content):
                with suppress(OSError):
                    saved.append((path.stat().st_mtime, path))
    return [path for _, path in sorted(saved, reverse=True)]


def _remove_others(kept: Path, matcher: Matcher) -> None:
    """Remove all other files, of other versions too; a process that has mapped one keeps it."""
    for path in kept.parent.glob(f"{matcher.name}-[0-9]*"):
        if path.name != kept.name:
            with suppress(OSError):
                path.unlink()
    with suppress(OSError):
        remove_unfinished(kept.parent, older_than_s=STALE_S)


def _renew(
    gallery: GalleryReader,
    matcher: Matcher,
    old: Prepared | None,
    engine: Engine,
    progress: Progress,
) -> Prepared:
    """Return the prints of a gallery, copied from the old ones where they are there."""
    numbers, digests = [], []
    fingers = gallery.fingers()
    missing: list[tuple[int, bytes]] = []
    before = [] if old is None else old.digest_list()
    place = {digest: k for k, digest in enumerate(before)}
    for number, data in gallery.packed_templates():
        digest = hashlib.sha256(data).digest()[:16]
        numbers.append(number)
        digests.append(digest)
        if digest not in place:
            missing.append((number, data))
    new, damaged = _prepare_all(matcher, missing, engine, progress)
    if damaged:
        gallery.damaged |= damaged
        sound = [k for k, number in enumerate(numbers) if number not in damaged]
        numbers, digests = [numbers[k] for k in sound], [digests[k] for k in sound]
    # an entry enrolled since `fingers` was read is a finger of its own until the next preparation
    shown = [fingers.get(number, number) for number in numbers]
    if old is None:
        prints = new
    elif len(digests) == len(before) + len(new) and digests[: len(before)] == before:
        # prints were only added
        prints = PreparedPrints.concatenate([old.prints, new])
    else:
        added = (new[k] for k in range(len(new)))
        kept = (old.prints[place[d]] if d in place else next(added) for d in digests)
        prints = PreparedPrints.pack(kept)
    of_entries = np.array(numbers, np.int64), np.array(shown, np.int64)
    listed = np.frombuffer(b"".join(digests), np.uint8).reshape(-1, 16)
    return Prepared(*of_entries, listed, prints)


def _prepare_all(
    matcher: Matcher, templates: Sequence[tuple[int, bytes]], engine: Engine, progress: Progress
) -> tuple[PreparedPrints, dict[int, str]]:
    """Return the prepared prints of those templates that are sound, and why others are not."""
    done, total = 0, len(templates)
    chunks = [templates[k : k + PRINTS_PER_CHUNK] for k in range(0, total, PRINTS_PER_CHUNK)]
    parts: list[PreparedPrints] = []
    damaged: dict[int, str] = {}
    progress("prepare", done, total)
    with engine, closing(engine.map(_prepare, matcher, chunks)) as results:
        for part, failed in results:
            parts.append(part)
            damaged |= failed
            done += len(part) + len(failed)
            progress("prepare", done, total)
    return PreparedPrints.concatenate(parts), damaged


def _prepare(
    matcher: Matcher, templates: Sequence[tuple[int, bytes]]
) -> tuple[PreparedPrints, dict[int, str]]:
    prepared, damaged = [], {}
    for number, data in templates:
        try:
            prepared.append(matcher.prepare(unpack_template(data)))
        except FpmatchError as error:
            damaged[number] = str(error)
    return PreparedPrints.pack(prepared), damaged
