"""Sensors: size and resolution of the image, and its grey levels."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.templates.minutiae import STANDARD_DPI, check_dpi

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fpmatch.lab.synthesis.classes import Range

SMALLEST_SIDE_PX: Final = 32
LARGEST_SIDE_PX: Final = 4096
BRIGHTER: Final = 30.0  # grey levels by which bare glass saturates more
SETTING: Final = np.array([0.4, 0.3, 0.5])  # deviation of the logarithms of what varies


@dataclass(frozen=True, slots=True)
class Sensor:
    """Describe a sensor; grey levels are 0 to 255, lengths pixels of the image.

    An ImageError is raised for a side that is not between 32 and 4096 pixels, a ResolutionError for
    a resolution outside 100 to 4000 dpi.
    """

    name: str
    width: int
    height: int
    dpi: float = STANDARD_DPI
    paper: float = 262.0  # grey level of bare glass
    ink: float = 40.0  # and of touching skin
    ceiling: float = 254.0  # brightest output; less than `paper` where bare glass saturates
    ink_variation: float = 14.0  # standard deviation over the image
    paper_variation: float = 0.0
    exposure: float = 0.0  # standard deviation of `paper` from image to image
    ink_fading: float = 60.0  # grey levels by which drier skin prints lighter, per unit of relief
    softness: float = 0.24  # height of relief over which an edge goes from paper to ink
    blur: float = 0.55  # standard deviation of the point spread
    noise: float = 2.0  # standard deviation of each pixel
    vignette: float = 0.0  # grey levels by which the corners are darker than the middle
    stripes: float = 0.0  # standard deviation of whole columns
    frame: float = 0.0  # share of the width by which a white frame cuts off either upper corner
    specks: int = 4  # most bits of dust on the glass
    dullness: float = 1.0  # factor of softness and blur where it takes detailed skin
    needed: float = 0.0  # height of detailed skin below which it takes nothing
    speckle: float = 0.0  # standard deviation of the height of detailed skin from pixel to pixel
    native: float = 1.0  # pixels taken for one of the image, where they repeat
    ink_grain: float = 0.0  # standard deviation of the grey levels of the ink of detailed skin
    fibres: float = 0.0  # and of the fibres of paper
    card: bool = False  # with lines, words and handwriting
    faintness: Range = (-0.1, 0.3)  # share of the contrast that the ink lacks, of detailed skin
    residue: float = 0.0  # density of the fine dots that damp skin leaves around the print

    def __post_init__(self) -> None:
        if not all(SMALLEST_SIDE_PX <= side <= LARGEST_SIDE_PX for side in self.shape):
            raise ImageError(
                f"sensor {self.name}: {self.width} x {self.height} pixels; each side must lie "
                f"between {SMALLEST_SIDE_PX} and {LARGEST_SIDE_PX}"
            )
        object.__setattr__(self, "dpi", check_dpi(self.dpi))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the image."""
        return self.height, self.width

    @property
    def px(self) -> float:
        """Pixels of the image for one at 500 dpi."""
        return self.dpi / STANDARD_DPI


def as_set(sensor: Sensor, rng: np.random.Generator) -> Sensor:
    """Return a sensor as it takes one image: with other optics and another depth of ink."""
    softer, duller, uneven = np.exp(SETTING * rng.standard_normal(3))
    brighter = rng.uniform(0, BRIGHTER) if sensor.paper > sensor.ceiling else 0.0
    return replace(
        sensor,
        paper=sensor.paper + brighter,
        ink=sensor.ink + (sensor.paper - sensor.ink) * rng.uniform(*sensor.faintness),
        softness=sensor.softness * sensor.dullness * softer,
        blur=sensor.blur * sensor.dullness * duller,
        ink_variation=sensor.ink_variation * uneven,
    )


# fmt: off
_SENSORS: Final = (
    Sensor("optical-388x374", 388, 374, dullness=1.15, needed=0.2),
    Sensor("optical-296x560", 296, 560, 569.0, paper=189.0, ink=34.0, paper_variation=3.0,
           exposure=6.0, ink_variation=8.0, ink_fading=26.0, softness=0.25, blur=0.7, noise=2.6,
           vignette=70.0, needed=0.1, residue=0.9),
    Sensor("capacitive-300x300", 300, 300, paper=127.0, ink=36.0, paper_variation=4.0,
           exposure=6.0, ink_variation=3.0, ink_fading=14.0, softness=0.2, blur=0.45, noise=3.8,
           vignette=12.0, stripes=1.6, dullness=0.75, speckle=0.27, residue=1.6),
    Sensor("plain-288x384", 288, 384, paper=194.0, ink=42.0, paper_variation=3.0, exposure=3.0,
           ink_variation=10.0, ink_fading=40.0, softness=0.26, noise=3.0, vignette=45.0,
           ink_grain=16.0, residue=0.25),
    Sensor("optical-640x480", 640, 480, ink=34.0, ceiling=255.0, ink_variation=18.0, specks=3),
    Sensor("optical-328x364", 328, 364, paper=202.0, ink=48.0, ceiling=255.0, exposure=7.0,
           paper_variation=4.0, ink_variation=12.0, ink_fading=34.0, softness=0.3, blur=0.75,
           noise=3.0, vignette=10.0, native=0.72, frame=0.13),
    Sensor("rolled-512x512", 512, 512, paper=202.0, ink=30.0, ceiling=255.0, paper_variation=4.0,
           exposure=8.0, ink_variation=11.0, ink_fading=40.0, softness=0.4, blur=0.7, noise=1.6,
           ink_grain=6.5, fibres=3.0, card=True, faintness=(0.0, 0.5)),
)
# fmt: on
SENSORS: Final[Mapping[str, Sensor]] = MappingProxyType({s.name: s for s in _SENSORS})
"""The sensors of FVC2002 DB1 to DB4 and of FVC2004 DB1 and DB2, and ink on cards, by name."""
