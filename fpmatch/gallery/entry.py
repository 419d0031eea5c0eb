"""Enrolled impressions and their labels."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.minutiae import Template


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

    def __str__(self) -> str:
        return "_".join(part for part in (self.subject, self.finger, self.impression) if part)


@dataclass(frozen=True, slots=True)
class EnrolmentRequest:
    """Hold what is known of a print before its template is extracted.

    `content` is the SHA-256 of its file, by which it is recognised under any name; `dpi` is None
    for the resolution in the file.
    """

    label: Label
    content: bytes
    dpi: float | None = None
    path: Path | None = None


@dataclass(frozen=True, slots=True)
class NewEntry:
    """Hold an impression to be enrolled; `source` is the name of its file."""

    label: Label
    source: str
    content: bytes
    template: Template


@dataclass(frozen=True, slots=True)
class Entry:
    """Hold one enrolled impression without its template.

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


@dataclass(frozen=True, slots=True)
class Failure:
    """Hold which file could not be enrolled, and why."""

    source: str
    reason: str


@dataclass(frozen=True, slots=True)
class GallerySummary:
    """Hold counts and sizes of a gallery; `dpi` counts impressions by resolution."""

    version: int
    impressions: int
    subjects: int
    minutiae: int
    template_bytes: int
    dpi: dict[float, int]
    failures: int

    def as_dict(self) -> dict[str, Any]:
        """Return the JSON values that ``fpmatch gallery info --json`` prints."""
        by_dpi = [{"dpi": dpi, "impressions": count} for dpi, count in self.dpi.items()]
        return asdict(self) | {"dpi": by_dpi}
