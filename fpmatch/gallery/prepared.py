"""Prepared prints of a gallery, kept in flat files that later searches map into memory.

The files are beside the gallery, in ``prints.db.prepared/``, or in the user's cache folder where
that is impossible, as for PostgreSQL. They may be deleted at any time. They are recomputed when the
gallery or the matcher has changed; prints that are in the old files are copied.
"""

from __future__ import annotations

import hashlib
import secrets
from contextlib import closing, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.engine.engine import processes
from fpmatch.errors import MatcherError, OutputError
from fpmatch.gallery.rows import unpack_entry
from fpmatch.matching.packed_templates import PackedTemplates
from fpmatch.output import atomic_write, make_folder

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.engine.engine import Engine
    from fpmatch.engine.workers import Progress
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.matching.result import Matcher

PRINTS_PER_CHUNK: Final = 64
_ENTRY: Final = np.dtype([("number", "<i8"), ("finger", "<i8"), ("digest", "V16")])


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """Hold the prepared prints of a gallery.

    For each, `entries` holds the number of its entry, the lowest number of an entry of its finger,
    and a digest of its template.
    """

    entries: NDArray[np.void]
    prints: PackedTemplates


def prepare_gallery(
    gallery: Gallery, matcher: Matcher, *, engine: Engine | None, progress: Progress
) -> Prepared:
    """Return the prepared prints of a gallery by number, from files where it has not changed.

    `progress` is called with stage "prepare" and numbers of prints that are in no file.
    """
    content = gallery.content_hash()
    folders = _folders(gallery)
    form = f"{matcher.name}-{__version__}"
    for folder in folders:
        kept = _load(folder / f"{form}-{content}")
        if kept is not None:
            return kept
    prepared = _renew(gallery, matcher, _newest(folders, form), engine or processes(), progress)
    # Entries that were enrolled meanwhile may be among them: then no content has this name.
    name = content if gallery.content_hash() == content else secrets.token_hex(16)
    for folder in folders:
        with suppress(OutputError):
            _save(folder / f"{form}-{name}", prepared)
            _remove_others(folder, matcher, f"{form}-{name}")
            break
    return prepared


def _folders(gallery: Gallery) -> list[Path]:
    """Return the folders for prepared prints, the preferred one first."""
    from platformdirs import user_cache_path  # noqa: PLC0415

    file = gallery.file
    name = gallery.name if file is None else str(file.absolute())
    cache = user_cache_path("fpmatch") / "galleries"
    beside = [] if file is None else [file.with_name(f"{file.name}.prepared")]
    return [*beside, cache / hashlib.sha256(name.encode("utf-8", "replace")).hexdigest()[:32]]


def _load(stem: Path) -> Prepared | None:
    """Return the content of the two files of `stem`, None where they cannot be used."""
    try:
        entries = np.load(f"{stem}.entries.npy", mmap_mode="r", allow_pickle=False)
        prints = PackedTemplates.load(f"{stem}.prints")
    except (OSError, ValueError, EOFError, MatcherError):
        return None
    if entries.dtype != _ENTRY or entries.shape != (len(prints),):
        return None
    return Prepared(entries, prints)


def _save(stem: Path, prepared: Prepared) -> None:
    make_folder(stem.parent)
    with atomic_write(f"{stem}.entries.npy") as stream:
        np.save(stream, prepared.entries, allow_pickle=False)
    prepared.prints.save(f"{stem}.prints")


def _newest(folders: Sequence[Path], form: str) -> Prepared | None:
    """Return the prints that were saved last, of whatever content."""
    found: list[tuple[float, Path]] = []
    for path in (path for folder in folders for path in folder.glob(f"{form}-*.prints")):
        with suppress(OSError):
            found.append((path.stat().st_mtime, path.with_name(path.stem)))
    loaded = (_load(stem) for _, stem in sorted(found, reverse=True))
    return next((kept for kept in loaded if kept is not None), None)


def _remove_others(folder: Path, matcher: Matcher, name: str) -> None:
    """Remove all other files, of other versions too; a process that has mapped one keeps it."""
    for path in folder.glob(f"{matcher.name}-[0-9]*"):
        if not path.name.startswith(f"{name}."):
            with suppress(OSError):
                path.unlink()


def _renew(
    gallery: Gallery, matcher: Matcher, old: Prepared | None, engine: Engine, progress: Progress
) -> Prepared:
    """Return the prints of a gallery, copied from the old ones where they are there."""
    numbers, digests = [], []
    fingers = gallery.fingers()
    missing: list[tuple[int, bytes]] = []
    place = {} if old is None else {d: k for k, d in enumerate(old.entries["digest"].tolist())}
    for number, data in gallery.packed_templates():
        digest = hashlib.sha256(data).digest()[:16]
        numbers.append(number)
        digests.append(digest)
        if digest not in place:
            missing.append((number, data))
    # an entry enrolled since `fingers` was read is a finger of its own until the next preparation
    shown = [fingers.get(number, number) for number in numbers]
    entries = np.array(list(zip(numbers, shown, digests, strict=True)), _ENTRY)
    new = _prepare_all(gallery.name, matcher, missing, engine, progress)
    if old is None:
        return Prepared(entries, new)
    before = entries["digest"][: len(old.prints)]
    if len(entries) == len(old.prints) + len(new) and (before == old.entries["digest"]).all():
        # prints were only added
        return Prepared(entries, PackedTemplates.concatenate([old.prints, new]))
    added = (new[k] for k in range(len(new)))
    kept = (old.prints[place[d]] if d in place else next(added) for d in digests)
    return Prepared(entries, PackedTemplates.pack(kept))


def _prepare_all(
    name: str,
    matcher: Matcher,
    templates: Sequence[tuple[int, bytes]],
    engine: Engine,
    progress: Progress,
) -> PackedTemplates:
    done, total = 0, len(templates)
    chunks = [templates[k : k + PRINTS_PER_CHUNK] for k in range(0, total, PRINTS_PER_CHUNK)]
    parts: list[PackedTemplates] = []
    progress("prepare", done, total)
    with engine, closing(engine.map(_prepare, (name, matcher), chunks)) as results:
        for part in results:
            parts.append(part)
            done += len(part)
            progress("prepare", done, total)
    return PackedTemplates.concatenate(parts)


def _prepare(
    shared: tuple[str, Matcher], templates: Sequence[tuple[int, bytes]]
) -> PackedTemplates:
    name, matcher = shared
    return PackedTemplates.pack(
        matcher.prepare(unpack_entry(data, number, name)) for number, data in templates
    )
