"""Prints to enrol, enrolled impressions, and their labels, which the names of files contain."""

from __future__ import annotations

import os
import re
from collections import Counter
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import GalleryError
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.printable import printable

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

MOST_LETTERS: Final = 255
"""Of a subject, a finger or an impression."""
_NAMES: Final = ("subject", "finger", "impression")
FVC_PATTERN: Final = r"(?P<subject>\d+)_(?P<impression>\d+)"


@dataclass(frozen=True, slots=True, order=True)
class Label:
    """Identify one impression in a gallery, by three names together.

    `subject` is, in FVC's names, where each finger counts as a subject, the finger; `finger` and
    `impression` are "" where that is not known.

    Examples
    --------
    >>> str(Label("101", impression="3")), str(Label("ada", "right-index", "1"))
    ('101_3', 'ada_right-index_1')
    """

    subject: str
    finger: str = ""
    impression: str = ""

    @property
    def of_finger(self) -> Label:
        """The label without its impression, common to all impressions of the finger."""
        return Label(self.subject, self.finger)

    def check(self) -> None:
        """Raise GalleryError (code "label") unless the names are ones that a gallery may hold."""
        for name in _NAMES:
            text = getattr(self, name)
            if printable(text) != text:
                raise GalleryError(f"{name}: must be text of one line: {text!r}", code="label")
            if len(text) > MOST_LETTERS:
                raise GalleryError(f"{name}: longer than {MOST_LETTERS} characters", code="label")
            if (text or name == "subject") and not text.strip():
                raise GalleryError(f"{name}: is blank", code="label")

    def __str__(self) -> str:
        return "_".join(part for part in (self.subject, self.finger, self.impression) if part)


@dataclass(frozen=True, slots=True)
class NamePattern:
    """Find labels in paths by a regular expression, by default that of FVC's names, ``101_3.tif``.

    It has a group named ``subject`` and, where names contain them, ``finger`` and ``impression``;
    raises GalleryError for another. It must match the end of the path, without the extension, from
    the beginning of a name in it on: one with a ``/`` matches folders, too.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fpmatch.gallery.listing.entry import NamePattern
    >>> NamePattern().label(Path("prints/101_3.tif"))
    Label(subject='101', finger='', impression='3')
    >>> by_folder = NamePattern("(?P<subject>[^/]+)/(?P<finger>[a-z]+)-(?P<impression>[0-9]+)")
    >>> by_folder.label(Path("prints/ada/index-2.png"))
    Label(subject='ada', finger='index', impression='2')
    >>> NamePattern().label(Path("holiday.jpg")) is None
    True
    """

    text: str = FVC_PATTERN

    def __post_init__(self) -> None:
        try:
            groups = re.compile(self.text).groupindex
        except (re.error, OverflowError, RecursionError) as error:
            why = f"not a regular expression: {error}"
            raise GalleryError(f"pattern {self.text!r}: {why}") from error
        if not {"subject"} <= set(groups) <= {"subject", "finger", "impression"}:
            raise GalleryError(
                f"pattern {self.text!r}: it must have a group (?P<subject>...), may have "
                "(?P<finger>...) and (?P<impression>...), and no other named one"
            )

    def label(self, path: Path) -> Label | None:
        """Return the label in a path, None where the pattern does not match."""
        text = printable(path.absolute().with_suffix("")).replace(os.sep, "/")
        expression = re.compile(self.text)
        start = len(text)
        while start > 0:
            start = text.rfind("/", 0, start)
            match = expression.fullmatch(text, start + 1)
            if match is not None and match["subject"]:
                return Label(**match.groupdict(""))
        return None


@dataclass(frozen=True, slots=True)
class PrintFile:
    """The file of an image or a template, and its resolution (None: that in the file).

    `label` is that of a manifest, a pattern or the folders; None where only the file's name may
    contain one. `name` is the file's, or the path by which a manifest or a folder of folders has
    it, as `csv_cell` makes it. `place` is the folder above its own, or the manifest, from which it
    was taken.
    """

    path: Path
    dpi: float | None = None
    label: Label | None = None
    name: str = ""
    place: Path | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", csv_cell(self.name or self.path.name))


@dataclass(frozen=True, slots=True)
class EnrolmentRequest:
    """The label, the file and the resolution of a print whose template is not yet extracted.

    `content` is the SHA-256 of its file, by which it is recognised under any name; `dpi` is None
    for the resolution in the file. Raises GalleryError as `Label.check` does.
    """

    label: Label
    content: bytes
    dpi: float | None = None

    def __post_init__(self) -> None:
        self.label.check()


@dataclass(frozen=True, slots=True)
class NewEntry:
    """An impression to be enrolled; `fpmatch.gallery.store.rows.new_entry` makes one.

    `content` is the SHA-256 of the file `source`; the `template` is packed, as a gallery stores it,
    and `dpi` and `minutiae`, their number, are its own. Raises GalleryError as `Label.check` does.
    """

    label: Label
    source: str
    content: bytes
    dpi: float
    minutiae: int
    template: bytes

    def __post_init__(self) -> None:
        self.label.check()


@dataclass(frozen=True, slots=True)
class Entry:
    """One enrolled impression without its template.

    `id` is never given twice, and later entries have greater ones. `content` is the SHA-256 of the
    file `source`; `minutiae` is the number of minutiae.
    """

    id: int
    label: Label
    source: str
    content: bytes
    dpi: float
    minutiae: int

    def as_dict(self) -> dict[str, Any]:
        """Return its values as JSON has them."""
        return {
            "id": self.id,
            **asdict(self.label),
            "source": self.source,
            "sha256": self.content.hex(),
            "dpi": self.dpi,
            "minutiae": self.minutiae,
        }


def entry_names(entries: Sequence[Entry]) -> list[str]:
    """Return the labels of entries as cells of CSV, with the number where several are the same."""
    labels = [csv_cell(str(entry.label)) for entry in entries]
    times = Counter(labels)
    return [
        label if times[label] == 1 else f"{label}#{entry.id}"
        for label, entry in zip(labels, entries, strict=True)
    ]


@dataclass(frozen=True, slots=True)
class Failure:
    """The file of a print that could not be enrolled, or does not match, and why."""

    source: str
    reason: str
