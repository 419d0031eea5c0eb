"""The two sides of `fpmatch score`: folders, manifests or galleries, as names and templates."""

from __future__ import annotations

import hashlib
import re
import zlib
from contextlib import closing
from dataclasses import dataclass
from functools import cache, partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from fpmatch.errors import FpmatchError, ScoringError, TemplateError, without_path
from fpmatch.formats.json_format import CODEC, decode, encode
from fpmatch.formats.record import ReadingOptions, TemplateRecord, View, check_minutiae
from fpmatch.gallery.engine.workers import attempt_each
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.gallery.listing.entry import NamePattern, entry_names
from fpmatch.gallery.listing.manifest import kind_of
from fpmatch.gallery.listing.prints import extract_print, find_prints, folder_reader
from fpmatch.gallery.store.stored_template import (
    MAGIC,
    minutiae_digest,
    stored_minutiae_digest,
    unpack_template,
)
from fpmatch.image.dataset_folder import read_dataset_info
from fpmatch.prints.reading import ASSUMED_DPI

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Collection, Generator, Iterator, Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.listing.entry import Label, PrintFile
    from fpmatch.gallery.listing.prints import ExtractedPrint, Reader
    from fpmatch.image.io.read import GreyImage
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.templates.minutiae import Template

    OpenedPrint = tuple[PrintFile, GreyImage | TemplateRecord | FpmatchError]

_ESCAPED: Final = re.compile(r"\\x([0-9a-f]{2})|\\u([0-9a-f]{4})")  # first letter of a cell
_AT_ONCE: Final = 512  # entries of a gallery that are read by one query


@dataclass(frozen=True, slots=True)
class StoredTemplate:
    """The template of one print in bytes, for `unpack`, or the reason why there is none.

    `quality` is that of its image, 0 to 100; None where there is none. `digest` is equal for prints
    of the same frame and minutiae; b"" without minutiae.
    """

    data: bytes | None
    reason: str = ""
    dpi_assumed: bool = False
    notes: tuple[str, ...] = ()
    quality: int | None = None
    digest: bytes = b""

    @property
    def all_notes(self) -> tuple[str, ...]:
        """The notes, with one on the resolution where it was assumed."""
        return (*self.notes, ASSUMED_DPI) if self.dpi_assumed else self.notes


class PrintSource(Protocol):
    """Provides the prints of one side, in a fixed order.

    `place` is the path or address, `title` the name of the database, `names` and `fingers` those of
    its prints, all names different. `content_hash` differs whenever the prints have changed.
    """

    place: str
    title: str
    names: list[str]
    fingers: list[str]
    content_hash: str

    def templates(
        self, engine: Engine, numbers: Sequence[int]
    ) -> Generator[StoredTemplate, None, None]:
        """Yield some prints by their ascending numbers; `engine` extracts them if necessary."""


def open_source(
    place: str | os.PathLike[str],
    *,
    dpi: float | None = None,
    polarity: Polarity = "auto",
    reader: Callable[..., GreyImage | TemplateRecord] | None = None,
    pattern: NamePattern | None = None,
    names: Collection[str] | None = None,
) -> PrintSource:
    """Open one side of `fpmatch score`; its prints are read later.

    The place is a folder of prints, a manifest, or a gallery: a file or the URL of a database, of
    which only the entries are read that have one of the `names`, if these are given. Of the files
    of a folder, `dpi` and `pattern` are as for
    `fpmatch.gallery.listing.prints.find_prints`, `polarity` and `reader` as for
    `fpmatch.image.folder_traits.find_traits`. Raises FpmatchError if there is no such
    folder or gallery, or nothing in it.
    """
    if kind_of(place) in {"gallery", "file"}:
        return GallerySource(place, names)
    files = find_prints([place], dpi, pattern=pattern)
    return FolderSource(Path(place), files, dpi, polarity, reader)


class FolderSource:
    """The prints of a folder or manifest by name: images, to be extracted, or templates."""

    labels: list[Label] | None = None

    def __init__(
        self,
        place: Path,
        files: Sequence[PrintFile],
        dpi: float | None,
        polarity: Polarity,
        reader: Callable[..., GreyImage | TemplateRecord] | None,
    ) -> None:
        self._files = files
        info = read_dataset_info(place if place.is_dir() else place.parent)
        known = info.polarity if polarity == "auto" else polarity
        self._open_reader = cache(
            partial(folder_reader, self._files, polarity=known, dpi=dpi, reader=reader)
        )
        self.place = str(place)
        self.title = csv_cell(info.name or (place.resolve().name if place.is_dir() else place.stem))
        self.names = [file.name for file in files]
        self.paths = [str(file.path) for file in files]
        labels = [file.label for file in files]
        by_name = [one.label or NamePattern().label(Path(one.path.name)) for one in files]
        self.fingers = [
            file.path.stem if label is None else str(label.of_finger)
            for file, label in zip(files, by_name, strict=True)
        ]
        if kind_of(place) == "manifest" and all(labels):
            self.labels = [label for label in labels if label is not None]
        states = [repr(_state(file)) for file in files]
        if any(labels):
            states.append(repr(self.fingers))
        parts = states if known == "auto" else [*states, repr(known)]
        self.content_hash = hashlib.sha256("\n".join(parts).encode()).hexdigest()

    def templates(
        self, engine: Engine, numbers: Sequence[int]
    ) -> Generator[StoredTemplate, None, None]:
        """Yield some prints by their numbers."""
        # Read here, so that workers elsewhere need not see the files.
        opened = (_open(self._open_reader(), self._files[n]) for n in numbers)
        with closing(attempt_each(engine, _extract, opened)) as attempts:
            for (file, _), attempt in attempts:
                why = without_path(attempt.reason, file.path)
                yield attempt.result or StoredTemplate(None, why)


class GallerySource:
    """The entries of a gallery by their numbers, or some by `names`, with the templates it holds.

    `damaged` are entries without a name, which are left out, with reasons.
    """

    def __init__(self, place: str | os.PathLike[str], names: Collection[str] | None = None) -> None:
        from fpmatch.gallery.gallery import open_gallery  # noqa: PLC0415  (imports SQLAlchemy)

        self._open = partial(open_gallery, place)
        with self._open() as gallery:
            self.place, self.title = gallery.name, csv_cell(gallery.name)
            self.content_hash = gallery.content_hash()
            if not len(gallery):
                raise ScoringError(f"{self.place}: the gallery is empty")
            if names is None:
                entries = list(gallery.entries())
            else:
                subjects = {subject for name in names for subject in _subjects_of(name)}
                by_subject = gallery.entries_by_subject(subjects)
                entries = sorted(chain(*by_subject.values()), key=lambda entry: entry.id)
            self.damaged = dict(gallery.damaged)
        self._numbers = [entry.id for entry in entries]
        self.fingers = [str(entry.label.of_finger) for entry in entries]
        self.names = entry_names(entries)
        if names is not None:
            state = f"{self.content_hash} {self._numbers}"
            self.content_hash = hashlib.sha256(state.encode()).hexdigest()

    def templates(
        self, engine: Engine, numbers: Sequence[int]
    ) -> Generator[StoredTemplate, None, None]:
        """Yield some prints by their ascending numbers."""
        from fpmatch.gallery.store.audit import ranges  # noqa: PLC0415  (imports SQLAlchemy)

        wanted = [self._numbers[n] for n in numbers]
        with self._open() as gallery:
            gallery.record("read templates", entries=ranges(wanted))
            for k in range(0, len(wanted), _AT_ONCE):
                some = wanted[k : k + _AT_ONCE]
                packed = dict(gallery.packed_templates(of=some))
                for number in some:
                    if number in packed:
                        yield _checked(packed[number])
                    elif number in gallery.damaged:
                        yield StoredTemplate(None, f"damaged: {gallery.damaged[number]}")
                    else:
                        why = "changed while it was read; start again"
                        raise ScoringError(f"{self.place}: {why}")


def _checked(data: bytes) -> StoredTemplate:
    """Return a packed template, or why it cannot be unpacked."""
    try:
        unpack_template(data)
    except TemplateError as error:
        return StoredTemplate(None, f"damaged: {error}")
    return StoredTemplate(data, digest=stored_minutiae_digest(data))


def _subjects_of(name: str) -> Iterator[str]:
    """Yield the subjects that an entry may have which a list of pairs calls by this name."""
    letters = _ESCAPED.match(name)
    if letters is not None:
        name = chr(int(letters[1] or letters[2], 16)) + name[letters.end() :]
    for label in {name, name.rpartition("#")[0]}:
        yield label
        yield from (label[:k] for k, letter in enumerate(label) if letter == "_")


def pack(template: Template) -> bytes:
    """Return a template as bytes, without loss, for `unpack`: a compressed file of JSON.

    Raises TemplateError if it has too many minutiae for a file.
    """
    check_minutiae(len(template))
    return zlib.compress(encode(TemplateRecord(CODEC.name, (View(template),))).data, level=1)


def unpack(data: bytes) -> Template:
    """Return the template of bytes that `pack` or a gallery made; FpmatchError if damaged."""
    if data.startswith(MAGIC):
        return unpack_template(data)
    try:
        return decode(zlib.decompress(data), ReadingOptions()).single().template
    except zlib.error as error:
        raise ScoringError("a stored template is damaged", code="damaged") from error


def _open(reader: Reader, file: PrintFile) -> OpenedPrint:
    """Read a print; an error is kept, too."""
    try:
        return file, reader(file.path)
    except FpmatchError as error:
        return file, error


def _extract(opened: OpenedPrint) -> StoredTemplate:
    """Return the template of a print, and the quality of its image."""
    file, content = opened
    if isinstance(content, FpmatchError):
        raise content
    return stored(extract_print(file, lambda _: content, graded=True))


def stored(made: ExtractedPrint) -> StoredTemplate:
    """Return a print with its template in bytes."""
    beside = made.dpi_assumed, made.notes, made.quality, minutiae_digest(made.template)
    return StoredTemplate(pack(made.template), "", *beside)


def _state(file: PrintFile) -> tuple[str, int, int, float | None]:
    try:
        status = file.path.stat()
    except OSError:  # a missing file fails when it is read, and becomes a row
        return file.name, -1, -1, file.dpi
    return file.name, status.st_size, status.st_mtime_ns, file.dpi
