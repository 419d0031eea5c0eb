"""A database to evaluate, and the genuine and impostor pairs of it that a protocol compares.

It is a folder of prints, folders of fingers, or a manifest. In FVC's style it is a folder of prints
``FFF_M.ext``, finger FFF and impression M.

References
----------
Maio, Maltoni, Cappelli, Wayman, Jain, "FVC2002: Second Fingerprint Verification Competition",
ICPR 2002, for the "fvc" protocol.
"""

from __future__ import annotations

import re
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError, ImageReadError, unknown_name
from fpmatch.gallery.batch.plan import GivenPairs
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.gallery.listing.entry import Label, NamePattern, PrintFile
from fpmatch.gallery.listing.folders import natural_key
from fpmatch.gallery.listing.manifest import kind_of, number_impressions
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.image.dataset_folder import read_dataset_info

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from fpmatch.templates.minutiae import Template

PROTOCOLS: Final = ("extended", "fvc")
_BAND: Final = 256  # references that are compared with all probes before the next
_LEAST_CHUNK, _MOST_CHUNK = 512, 4096  # pairs
_PRINT_NAME: Final = re.compile(r"(\d+)_(\d+)", re.ASCII)


@dataclass(frozen=True, slots=True)
class Impression:
    """One print of a database: its finger, its file, its name, and its resolution if stated."""

    finger: str
    path: Path
    name: str
    dpi: float | None = None


@dataclass(frozen=True, slots=True)
class Dataset:
    """One database: its name is from ``dataset.toml``, else the folder's or the file's.

    Impressions are sorted by finger and by their own numbers or names. `place` is the folder or
    manifest from which they are; `notes` are about the whole database. `templates` belong to all
    impressions where they are known already, None where there is none.
    """

    name: str
    impressions: tuple[Impression, ...]
    place: str
    notes: tuple[str, ...] = ()
    templates: tuple[Template | None, ...] = ()


def load_dataset(
    place: str | os.PathLike[str],
    *,
    pattern: str | NamePattern | None = None,
    dpi: float | None = None,
) -> Dataset:
    r"""Find the prints of a database, by finger and impression, and read its description.

    No image is read. The prints of a folder are its images or, where it has none, its templates,
    named ``FFF_M`` and an extension; others are ignored. Where it has neither, its subfolders are
    fingers, or subjects whose subfolders are fingers. `place`: a folder or a manifest (see
    `fpmatch.gallery.listing.manifest`). `pattern`: finds subject, finger and impression in other
    names; prints that it does not match are left out. `dpi`: the resolution of all prints (default:
    that in the manifest or ``dataset.toml``, else the file's own). Raises a `DatasetError` if there
    is no such database, it holds no print or holds one twice (``101_1.tif`` and ``101_1.png``), or
    its ``dataset.toml`` or manifest is malformed; a `GalleryError` if the pattern is none.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.databases.dataset import load_dataset
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name in ("ada_left_1.png", "ada_left_2.png", "bob_right_1.png"):
    ...         Path(folder, name).touch()
    ...     found = load_dataset(folder, pattern=r"(?P<subject>\w+?)_(?P<finger>\w+)_\d")
    >>> [(one.finger, one.name) for one in found.impressions][1:]
    [('ada/left', 'ada_left_2.png'), ('bob/right', 'bob_right_1.png')]
    """
    names = NamePattern(pattern) if isinstance(pattern, str) else pattern
    kind, root = kind_of(place), Path(place)
    if kind == "gallery":
        why = "a gallery is compared by fpmatch score, and fpmatch rates reads its scores"
        raise DatasetError(why, path=place)
    if kind == "file":
        why = "not a folder of prints, nor a manifest, which has the columns path and subject"
        raise DatasetError(why, path=root)
    try:
        files = find_prints([root], dpi, pattern=names)
    except ImageReadError as error:
        why = "holds no prints, nor folders of them" if root.is_dir() else "no such folder"
        raise DatasetError(why, path=root, code=error.code) from error
    notes = []
    if kind == "folder" and names is None:
        if all(one.label is not None and not one.label.finger for one in files):
            notes.append("each folder in it is taken for one finger (--pattern for other layouts)")
        files = [replace(one, label=one.label or _by_number(one.path)) for one in files]
    labelled = [(file.label, file) for file in files if file.label is not None]
    if not labelled:
        why = "holds no prints named FFF_M (finger, impression); --pattern finds other names"
        if names is not None:
            why = f"no print fits the pattern {names.text}, as {files[0].name} does not"
        raise DatasetError(why, path=root, code="no names")
    if names is not None and (left_out := len(files) - len(labelled)) > 0:
        notes.append(f"{left_out} of {len(files)} prints do not fit the pattern; they are left out")
    info = read_dataset_info(root if root.is_dir() else root.parent)
    name = info.name or (root.stem if root.is_file() else root.resolve().name)
    return Dataset(csv_cell(name), _sorted(labelled, root), str(root), tuple(notes))


def _by_number(path: Path) -> Label | None:
    """Return the label in a name ``FFF_M``, whose leading zeros mean nothing."""
    named = _PRINT_NAME.fullmatch(path.stem)
    return None if named is None else Label(str(int(named[1])), "", str(int(named[2])))


def _sorted(labelled: Sequence[tuple[Label, PrintFile]], root: Path) -> tuple[Impression, ...]:
    """Return prints with labels as impressions, sorted by finger and impression."""
    labels = number_impressions([label for label, _ in labelled])
    files: dict[Label, PrintFile] = {}
    for label, (_, file) in zip(labels, labelled, strict=True):
        if label in files:
            why = f"{files[label].name} and {file.name} are the same impression, {label}"
            raise DatasetError(why, path=root, code="duplicate")
        files[label] = file
    fingers: dict[str, Label] = {}
    impressions = []
    for label in sorted(files, key=lambda one: [natural_key(part) for part in astuple(one)]):
        finger = "/".join(filter(None, astuple(label.of_finger)))
        if fingers.setdefault(finger, label.of_finger) != label.of_finger:
            raise DatasetError(f"{finger!r} is the name of a subject and of a subject's finger")
        file = files[label]
        impressions.append(Impression(finger, file.path, file.name, file.dpi))
    return tuple(impressions)


def choose_pairs(impressions: Sequence[Impression], protocol: str = "extended") -> GivenPairs:
    """Choose the pairs that a protocol compares.

    Both protocols take every unordered pair of impressions of one finger as genuine. As impostor
    pairs, "extended" takes all unordered pairs of impressions of different fingers, "fvc" only
    pairs of the fingers' first impressions. `impressions`: a database's impressions, in their
    order. `protocol`: "extended" or "fvc". Every probe is paired with the first 256 references,
    then with the next. Raises a `DatasetError` if the protocol is unknown.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.databases.dataset import PROTOCOLS, Impression, choose_pairs
    >>> prints = [Impression(f, Path(f + n), f + n) for f in ("1_", "2_") for n in ("1", "2")]
    >>> extended, fvc = (choose_pairs(prints, name) for name in PROTOCOLS)
    >>> [(int(p.genuine.sum()), int((~p.genuine).sum())) for p in (extended, fvc)]
    [(2, 4), (2, 1)]
    """
    if protocol not in PROTOCOLS:
        raise DatasetError(unknown_name("protocol", protocol, PROTOCOLS))
    fingers = [one.finger for one in impressions]
    _, first, finger = np.unique(fingers, return_index=True, return_inverse=True)
    probe, reference = np.triu_indices(len(impressions), k=1)
    order = np.argsort(reference // _BAND, kind="stable")
    probe, reference = probe[order], reference[order]
    genuine = finger[probe] == finger[reference]
    if protocol == "fvc":
        chosen = genuine | (np.isin(probe, first) & np.isin(reference, first))
        probe, reference, genuine = probe[chosen], reference[chosen], genuine[chosen]
    size = min(max(probe.size // 64, _LEAST_CHUNK), _MOST_CHUNK)
    return GivenPairs(probe, reference, genuine, name=protocol, pairs_per_chunk=size)
