"""What a gallery holds, in words: labels, entries, failures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fpmatch.minutiae import Template


@dataclass(frozen=True, slots=True, order=True)
class Label:
    """Name one impression in a gallery; the three together name it alone.

    Parameters
    ----------
    subject : str
        Whose it is; in FVC's names, where each finger counts for itself, the finger.
    finger, impression : str
        Which finger, and which time; "" where that is not told.

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
        """The label without its impression, which all impressions of the finger share."""
        return Label(self.subject, self.finger)

    def __str__(self) -> str:
        return "_".join(part for part in (self.subject, self.finger, self.impression) if part)


@dataclass(frozen=True, slots=True)
class NewEntry:
    """Hold one impression that is to be enrolled.

    Parameters
    ----------
    label : Label
        What it is to be called.
    source : str
        Where its picture lies.
    content : bytes
        SHA-256 of the picture's file, by which it is known under any name.
    template : Template
        Its template.
    """

    label: Label
    source: str
    content: bytes
    template: Template


@dataclass(frozen=True, slots=True)
class Entry:
    """Hold what a gallery says of one enrolled impression, but for its template.

    Parameters
    ----------
    id : int
        Its number, given once and never again; later entries have greater ones.
    label : Label
        What it is called.
    source : str
        Where its picture lay.
    content : bytes
        SHA-256 of the picture's file.
    dpi : float
        Resolution of the picture in dots per inch.
    minutiae : int
        How many minutiae its template has.
    """

    id: int
    label: Label
    source: str
    content: bytes
    dpi: float
    minutiae: int


@dataclass(frozen=True, slots=True)
class Failure:
    """Hold which picture could not be enrolled, and why."""

    source: str
    reason: str
