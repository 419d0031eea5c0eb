r"""Manifests, CSV files that list prints with their subjects and fingers, and what else is given.

An example::

    path,subject,finger,impression,dpi
    scans/0001.png,ada,right index,1,500
    scans/0002.png,ada,right index,2,1000

The first row names the columns; only ``path`` and ``subject`` are needed, and columns of other
names are ignored. A relative path is relative to the manifest; bytes of names that are not UTF-8,
and control characters, may be written as fpmatch prints them, ``101_\xff_1.tif``.
Impressions without a name are numbered from 1 on, for each finger. Where ``dpi`` is empty, the
resolution comes from a ``dataset.toml`` in the folder of the print, else from the file itself.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from fpmatch.base.parsing import read_head
from fpmatch.errors import DatasetError, GalleryError, ResolutionError
from fpmatch.gallery.listing.csv_rows import DELIMITERS, csv_rows, row_error
from fpmatch.gallery.listing.entry import Label, PrintFile
from fpmatch.printable import as_file_name
from fpmatch.templates.minutiae import check_dpi

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

SQLITE_HEADER: Final = b"SQLite format 3\0"
COLUMNS: Final = ("path", "subject", "finger", "impression", "dpi")
NEEDED: Final = COLUMNS[:2]
_at: Final = partial(row_error, DatasetError)
_FORM: Final = "a manifest has the columns path and subject, and may have finger, impression, dpi"

Kind = Literal["gallery", "manifest", "folder", "file"]


def kind_of(place: str | os.PathLike[str]) -> Kind:
    """Return whether a path or URL leads to a gallery, a manifest, a folder or any other file.

    Where nothing is, it is a "folder".

    Examples
    --------
    >>> kind_of("postgresql://me@host/prints"), kind_of("nowhere")
    ('gallery', 'folder')
    """
    path = Path(place)
    if "://" in str(place):
        return "gallery"
    if not path.is_file():
        return "folder"
    head = read_head(path)
    if head.startswith(SQLITE_HEADER):
        return "gallery"
    first = head.decode("utf-8", "replace").removeprefix("\ufeff").lstrip().partition("\n")[0]
    for mark in DELIMITERS:
        first = first.replace(mark, "\n")
    names = {cell.strip().strip('"').casefold() for cell in first.split("\n")}
    return "manifest" if "path" in names else "file"


def read_manifest(path: str | os.PathLike[str]) -> list[PrintFile]:
    """Read a manifest, in the form that this module describes.

    Raises DatasetError, which names file, line and column, if the file cannot be read, lacks a
    column, lists nothing, or a row is malformed, comes twice or lists a file that is missing.
    """
    source = Path(path)
    prints: list[PrintFile] = []
    labels: list[Label] = []
    lines: dict[Path | Label, int] = {}
    for line, values in _rows(source):
        try:
            file, label = _print_file(source, values)
            if (first := lines.setdefault(file.path.resolve(), line)) != line:
                raise DatasetError(f"column path: {file.name} is on line {first}, too")
            if label.impression and (first := lines.setdefault(label, line)) != line:
                raise DatasetError(f"column impression: {label} is on line {first}, too")
        except DatasetError as error:
            raise _at(source, line, str(error)) from error
        prints.append(file)
        labels.append(label)
    if not prints:
        raise DatasetError("the manifest lists no prints", path=path, code="empty")
    numbered = zip(prints, number_impressions(labels), strict=True)
    return [replace(file, label=label) for file, label in numbered]


def number_impressions(labels: Sequence[Label]) -> list[Label]:
    """Return labels of which those without an impression have got a number, in their order.

    Examples
    --------
    >>> [str(one) for one in number_impressions([Label("ada"), Label("ada", "", "1")])]
    ['ada_2', 'ada_1']
    """
    taken = set(labels)
    numbers: dict[Label, count[int]] = defaultdict(lambda: count(1))
    numbered = []
    for label in labels:
        one = label
        while not one.impression or (one is not label and one in taken):
            one = replace(label, impression=str(next(numbers[label.of_finger])))
        numbered.append(one)
    return numbered


def _rows(source: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield line and values of each row, by the names of `COLUMNS`."""
    rows = csv_rows(source, DatasetError)
    line, head = next(rows, (1, []))
    names = [cell.casefold() for cell in head]
    for name in COLUMNS:
        if names.count(name) > 1:
            raise _at(source, line, f"more than one column {name}")
        if name in NEEDED and name not in names:
            raise _at(source, line, f"no column {name}; {_FORM}")
    for line, cells in rows:
        if len(cells) > len(names) and any(cells[len(names) :]):
            raise _at(source, line, f"{len(cells)} values, of {len(names)} columns")
        given = dict(zip(names, cells, strict=False))
        yield line, {name: given.get(name, "") for name in COLUMNS}


def _print_file(source: Path, values: dict[str, str]) -> tuple[PrintFile, Label]:
    """Return the print of a row and its label; raise a DatasetError that names the column."""
    for name in NEEDED:
        if not values[name]:
            raise DatasetError(f"column {name}: is empty")
    label = Label(values["subject"], values["finger"], values["impression"])
    try:
        label.check()
    except GalleryError as error:
        raise DatasetError(f"column {error}") from error
    try:
        dpi = check_dpi(float(values["dpi"])) if values["dpi"] else None
    except ValueError as error:
        raise DatasetError(f"column dpi: {values['dpi']!r} is not a number") from error
    except ResolutionError as error:
        raise DatasetError(f"column dpi: {error}") from error
    names = (values["path"], as_file_name(values["path"]))
    file = next((file for name in names if _is_file(file := source.parent / name)), None)
    if file is None:
        raise DatasetError(f"column path: {values['path']}: no such file")
    return PrintFile(file, dpi, name=values["path"]), label


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no system accepts
        return False
