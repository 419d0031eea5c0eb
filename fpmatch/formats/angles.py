"""How the angles of a file are measured that does not define it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError

if TYPE_CHECKING:
    from numpy.typing import NDArray

_UNITS: Final = ("deg", "rad")
_CLOCKWISE, _OPPOSITE = "clockwise", "opposite"
UNKNOWN: Final = (
    "the file does not define how its angles are measured: --angles of verify, extract and convert "
    "does, as deg or rad, with ,clockwise where they increase clockwise on screen"
)


@dataclass(frozen=True, slots=True)
class AngleConvention:
    """Unit, sense and direction of minutia angles.

    They increase `clockwise` on screen, as those of ``atan2(dy, dx)`` with y down do, or
    counter-clockwise; directions are `opposite` to those of ISO/IEC 19794-2, as those of NIST's
    XYT, or as there.
    """

    unit: str
    clockwise: bool = False
    opposite: bool = False

    @classmethod
    def parse(cls, text: str) -> AngleConvention:
        """Return the convention that ``deg`` or ``rad``, ``,clockwise`` and ``,opposite`` mean."""
        unit, *words = (word.strip().lower() for word in text.split(","))
        known = {_CLOCKWISE, _OPPOSITE}
        if unit not in _UNITS or not set(words) <= known or len(set(words)) < len(words):
            raise TemplateError(
                f"{text!r} is no convention of angles: deg or rad, then ,{_CLOCKWISE} or "
                f",{_OPPOSITE} or both"
            )
        return cls(unit, _CLOCKWISE in words, _OPPOSITE in words)

    def to_radians(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return angles in radians in fpmatch's own convention, not wrapped into one turn."""
        angles = np.radians(values) if self.unit == "deg" else values
        return (-angles if self.clockwise else angles) + (math.pi if self.opposite else 0.0)

    def __str__(self) -> str:
        unit = {"deg": "degrees", "rad": "radians"}[self.unit]
        sense = "clockwise" if self.clockwise else "counter-clockwise"
        direction = "opposite to ISO/IEC 19794-2" if self.opposite else "as in ISO/IEC 19794-2"
        return f"{unit}, {sense} on screen from +x, {direction}"


OWN_DEGREES: Final = AngleConvention("deg")


def range_notes(values: NDArray[np.float64], convention: AngleConvention) -> list[str]:
    """Return a note where angles lie in a range that is not that of their unit."""
    largest = float(np.abs(values).max(initial=0.0))
    if convention.unit == "deg" and len(values) >= 4 and largest <= 2 * math.pi:
        return ["all its angles are within 2π degrees; --angles rad reads them as radians"]
    if convention.unit == "rad" and largest > 4 * math.pi:
        return ["its angles exceed 4π radians; --angles deg reads them as degrees"]
    return []
