"""A database to evaluate, and the genuine and impostor pairs of it that a protocol compares.

It is a folder of prints, folders of fingers, a manifest or a gallery. In FVC's style it is a folder
of prints ``FFF_M.ext``, finger FFF and impression M.

References
----------
Maio, Maltoni, Cappelli, Wayman, Jain, "FVC2002: Second Fingerprint Verification Competition",
ICPR 2002, for the "fvc" protocol.
"""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError, ImageReadError, unknown_name
from fpmatch.gallery.batch.plan import PairChunk
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.gallery.listing.entry import Label, NamePattern, entry_names
from fpmatch.gallery.listing.folders import natural_key, prints_in
from fpmatch.gallery.listing.manifest import kind_of, number_impressions, read_manifest
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.image.dataset_folder import read_dataset_info
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.listing.entry import PrintFile
    from fpmatch.templates.minutiae import Template

PROTOCOLS: Final = ("extended", "fvc")
_BAND: Final = 256  # references that are compared with all probes before the next
_LEAST_CHUNK, _MOST_CHUNK = 512, 4096  # pairs
_PRINT_NAME: Final = re.compile(r"(\d+)_(\d+)", re.ASCII)
_TABLES: Final = (".csv", ".tsv", ".txt")  # whose first row is then missing a column
_FORMS: Final = "--pattern finds fingers in other names, and a manifest lists any"


@dataclass(frozen=True, slots=True, order=True)
class Impression:
    """The file of one print, its finger, and which impression of the finger it is.

    In a database the fingers are all numbers, as in FVC's names, or all names. `name` is the
    print's in the database, by default the file's, as `csv_cell` makes it; `dpi` its own
    resolution, where a manifest or a gallery states it.
    """

    finger: int | str
    number: int
    path: Path
    name: str = ""
    dpi: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", csv_cell(self.name or self.path.name))


@dataclass(frozen=True, slots=True)
class Dataset:
    """One database: its name is from ``dataset.toml``, else the folder's or the file's.

    `dpi` is the resolution of all prints (None: that of each file's own tag), and `sensor` is ""
    where it is not known. Impressions are sorted by finger and number. `place` is the folder,
    manifest or gallery from which they are; `notes` are about the whole database. `templates`
    belong to all impressions where they are known already, None where there is none.
    """

    name: str
    dpi: float | None
    sensor: str
    impressions: tuple[Impression, ...]
    place: str
    notes: tuple[str, ...] = ()
    in_gallery: bool = False
    templates: tuple[Template | None, ...] = ()

    def at(self, dpi: float | None) -> Dataset:
        """Return the database with all prints at `dpi`, unless that is None."""
        if dpi is None:
            return self
        impressions = tuple(replace(one, dpi=None) for one in self.impressions)
        return replace(self, dpi=check_dpi(dpi), impressions=impressions)


def load_dataset(
    place: str | os.PathLike[str],
    *,
    pattern: str | NamePattern | None = None,
) -> Dataset:
    r"""Find the prints of a database, by finger and impression, and read its description.

    No image is read. The prints of a folder are its images or, where it has none, its templates,
    named ``FFF_M`` and an extension; others are ignored. Where it has neither,
    its subfolders are fingers, or subjects whose subfolders are fingers. `place`: a folder, a
    manifest (see `fpmatch.gallery.listing.manifest`), or a gallery (file or URL). `pattern`: finds
    subject, finger and impression in other names; prints that it does not match are left out.
    Raises a `DatasetError` if there is no such database, it holds no
    print or holds one twice (``101_1.tif`` and ``101_1.png``), or its ``dataset.toml`` or manifest
    is malformed; a `GalleryError` if the gallery cannot be read, or the pattern is none.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.databases.dataset import load_dataset
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name in ("ada_left_1.png", "ada_left_2.png", "bob_right_1.png"):
    ...         Path(folder, name).touch()
    ...     found = load_dataset(folder, pattern=r"(?P<subject>\w+?)_(?P<finger>\w+)_\d")
    >>> [(one.finger, one.number, one.name) for one in found.impressions][1:]
    [('ada/left', 2, 'ada_left_2.png'), ('bob/right', 1, 'bob_right_1.png')]
    """
    names = NamePattern(pattern) if isinstance(pattern, str) else pattern
    kind, root = kind_of(place), Path(place)
    if kind == "gallery":
        return _of_gallery(place)
    if kind == "folder" and names is None:
        if numbered := _named_by_number(root):
            return _described(root, numbered)
        if prints_in(root):
            why = "holds no prints named FFF_M.tif (finger FFF, impression M)"
            raise DatasetError(f"{why}; {_FORMS}", path=root, code="no names")
    if kind == "file" and root.suffix.lower() not in _TABLES:
        raise DatasetError("not a folder of prints, a manifest or a gallery", path=root)
    try:
        files = (
            read_manifest(root)  # which says what it lacks
            if kind == "file"
            else find_prints([root], pattern=names)
        )
    except ImageReadError as error:
        why = "holds no prints, nor folders of them" if root.is_dir() else "no such folder"
        raise DatasetError(why, path=root, code=error.code) from error
    labelled = [(file.label, file) for file in files if file.label is not None]
    if not labelled and names is not None:
        why = f"no print fits the pattern {names.text}, as {files[0].name} does not"
        raise DatasetError(why, path=root, code="no names")
    notes = []
    if (left_out := len(files) - len(labelled)) > 0:
        notes.append(f"{left_out} of {len(files)} prints do not fit the pattern; they are left out")
    guessed = kind == "folder" and names is None
    if guessed and not any(label.finger for label, _ in labelled):
        notes.append("each folder in it is taken for one finger (--pattern for other layouts)")
    return _described(root, _by_label(root, labelled), tuple(notes))


def with_unique_names(datasets: Sequence[Dataset]) -> list[Dataset]:
    """Return databases with different names: a name that comes twice becomes the folder's."""
    count, unique = Counter(dataset.name for dataset in datasets), []
    for dataset in datasets:
        place = Path(dataset.place).resolve()
        own = csv_cell(place.stem if place.is_file() else place.name)
        unique.append(replace(dataset, name=own) if count[dataset.name] > 1 else dataset)
    return unique


def _described(
    root: Path, impressions: Sequence[Impression], notes: tuple[str, ...] = ()
) -> Dataset:
    """Return the prints of a folder or manifest with what ``dataset.toml`` there states."""
    info = read_dataset_info(root if root.is_dir() else root.parent)
    name = info.name or (root.stem if root.is_file() else root.resolve().name)
    return Dataset(csv_cell(name), info.dpi, info.sensor, tuple(impressions), str(root), notes)


def _named_by_number(root: Path) -> list[Impression]:
    """Return the prints of a folder that FVC's names ``FFF_M`` number."""
    paths: dict[tuple[int, int], Path] = {}
    for path in prints_in(root):
        named = _PRINT_NAME.fullmatch(path.stem)
        if named is None:
            continue
        key = (int(named[1]), int(named[2]))
        if key in paths:
            raise DatasetError(f"{root}: {paths[key].name} and {path.name} are the same impression")
        paths[key] = path
    return [Impression(*key, path) for key, path in sorted(paths.items())]


def _by_label(root: Path, labelled: Sequence[tuple[Label, PrintFile]]) -> list[Impression]:
    """Return prints with labels, sorted by finger and impression, which are numbered from 1."""
    labels = number_impressions([label for label, _ in labelled])
    files: dict[Label, PrintFile] = {}
    for label, (_, file) in zip(labels, labelled, strict=True):
        if label in files:
            why = f"{files[label].name} and {file.name} are the same impression, {label}"
            raise DatasetError(why, path=root, code="duplicate")
        files[label] = file
    return _numbered(
        {label: Impression(_finger(label), 0, f.path, f.name, f.dpi) for label, f in files.items()}
    )


def _numbered(impressions: Mapping[Label, Impression]) -> list[Impression]:
    """Return impressions sorted by finger and by the name of the impression, and numbered."""
    count: Counter[int | str] = Counter()
    of_finger: dict[int | str, Label] = {}
    numbered = []
    for label in sorted(impressions, key=lambda one: [natural_key(part) for part in astuple(one)]):
        finger = impressions[label].finger
        if of_finger.setdefault(finger, label.of_finger) != label.of_finger:
            raise DatasetError(f"{finger!r} is the name of a subject and of a subject's finger")
        count[finger] += 1
        numbered.append(replace(impressions[label], number=count[finger]))
    return numbered


def _finger(label: Label) -> str:
    return f"{label.subject}/{label.finger}" if label.finger else label.subject


def _of_gallery(place: str | os.PathLike[str]) -> Dataset:
    from fpmatch.gallery.gallery import open_gallery  # noqa: PLC0415  (imports a database)

    with open_gallery(place) as gallery:
        entries, title = list(gallery.entries()), gallery.name
        lost = tuple(f"entry {k} is left out: damaged: {why}" for k, why in gallery.damaged.items())
    if not entries:
        raise DatasetError("the gallery is empty", path=title, code="empty")
    impressions = {
        entry.label: Impression(_finger(entry.label), 0, Path(entry.source), name, entry.dpi)
        for entry, name in zip(entries, entry_names(entries), strict=True)
    }
    name = title if "://" in title else Path(title).stem
    return Dataset(csv_cell(name), None, "", tuple(_numbered(impressions)), str(place), lost, True)


class Pairs:
    """The pairs to compare, as indices into a database's impressions: a plan for `score`.

    `probe`, `reference` (N,): indices of the two impressions of each pair, probe < reference.
    `genuine` (N,): whether both show the same finger. See `fpmatch.gallery.batch.plan.Plan`.
    """

    def __init__(
        self, probe: NDArray[np.intp], reference: NDArray[np.intp], genuine: NDArray[np.bool_]
    ) -> None:
        self.probe, self.reference, self.genuine = probe, reference, genuine
        self._size = min(max(len(self) // 64, _LEAST_CHUNK), _MOST_CHUNK)
        self.number_of_chunks = -(-len(self) // self._size)
        self.probes: Sequence[int] = np.unique(probe).tolist()
        self.references: Sequence[int] = np.unique(reference).tolist()
        content = np.stack([probe, reference, genuine])
        self.identity = f"{hashlib.sha256(content.tobytes()).hexdigest()} by {self._size}"

    def __len__(self) -> int:
        return int(self.probe.size)

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs in their order, from chunk number `start` on."""
        for k in range(start * self._size, len(self), self._size):
            part = slice(k, k + self._size)
            sides = self.probe[part].astype(np.int32), self.reference[part].astype(np.int32)
            yield PairChunk(*sides, self.genuine[part].astype(np.int8))


def choose_pairs(impressions: Sequence[Impression], protocol: str = "extended") -> Pairs:
    """Choose the pairs that a protocol compares.

    Both protocols take every unordered pair of impressions of one finger as genuine. As impostor
    pairs, "extended" takes all unordered pairs of impressions of different fingers, "fvc" only
    pairs of the fingers' first impressions (their lowest numbers). `impressions`: a database's
    impressions. `protocol`: "extended" or "fvc". Every probe is paired with the first 256
    references, then with the next. Raises a `DatasetError` if the protocol is unknown.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.databases.dataset import PROTOCOLS, Impression, choose_pairs
    >>> prints = [Impression(f, n, Path(f"{f}_{n}.tif")) for f in (1, 2) for n in (1, 2)]
    >>> extended, fvc = (choose_pairs(prints, name) for name in PROTOCOLS)
    >>> [(int(p.genuine.sum()), int((~p.genuine).sum())) for p in (extended, fvc)]
    [(2, 4), (2, 1)]
    """
    if protocol not in PROTOCOLS:
        raise DatasetError(unknown_name("protocol", protocol, PROTOCOLS))
    _, finger = np.unique([str(one.finger) for one in impressions], return_inverse=True)
    probe, reference = np.triu_indices(len(impressions), k=1)
    order = np.argsort(reference // _BAND, kind="stable")
    probe, reference = probe[order], reference[order]
    genuine = finger[probe] == finger[reference]
    if protocol == "fvc":
        lowest = {i.finger: i.number for i in sorted(impressions, key=lambda i: -i.number)}
        first = np.array([i.number == lowest[i.finger] for i in impressions], dtype=bool)
        chosen = genuine | (first[probe] & first[reference])
        probe, reference, genuine = probe[chosen], reference[chosen], genuine[chosen]
    return Pairs(probe, reference, genuine)
