"""Sensors, and the image that each takes: grey levels of the skin that touches it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.synthesis.noise import smooth_noise
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.contact import Contact
    from fpmatch.lab.synthesis.orientation import Range

    Field = NDArray[np.float32]  # a value a pixel

BRIGHTER: Final = 30.0  # grey levels by which bare glass saturates more
SETTING: Final = np.array([0.4, 0.3, 0.5])  # deviation of the logarithms of what varies


@dataclass(frozen=True, slots=True)
class Sensor:
    """Describe a sensor; grey levels are 0 to 255, lengths pixels of the image."""

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
SENSORS: Final = {sensor.name: sensor for sensor in _SENSORS}
"""The sensors of FVC2002 DB1 to DB4 and of FVC2004 DB1 and DB2, and ink on cards, by name."""
DEFAULT_SENSOR: Final = "optical-388x374"


WORDS: Final = ("RIGHT THUMB", "RIGHT INDEX", "RIGHT MIDDLE", "RIGHT RING", "RIGHT LITTLE",
                "LEFT THUMB", "LEFT INDEX", "LEFT MIDDLE", "LEFT RING", "LEFT LITTLE")  # fmt: skip
WORD_CHANCE, MOST_LINES, MOST_STROKES = 0.5, 3, 3
MARGIN: Final = 0.08  # share of the side within which lines and words lie
STROKE_STEP: Final = 0.025  # of handwriting, share of the side
STROKE_STEPS: Final = (12, 60)  # least, and one more than most
STROKE_TURN: Final = 0.35  # standard deviation of the change of its turn, radians


def draw_card(shape: tuple[int, int], rng: np.random.Generator) -> Field:
    """Return the ink of one card, 0 to 1, (h, w)."""
    import cv2  # noqa: PLC0415

    rows, columns = shape
    ink = np.zeros(shape, np.uint8)
    for _ in range(int(rng.integers(0, MOST_LINES + 1))):
        side = rows if rng.random() < 0.7 else columns
        near = rng.uniform(0, MARGIN) * side
        at, slope = (near if rng.random() < 0.5 else side - near), rng.normal(scale=0.01) * side
        ends = [(0.0, at), (float(columns), at + slope)]
        if side is columns:
            ends = [(at, 0.0), (at + slope, float(rows))]
        begin, end = (tuple(round(value) for value in point) for point in ends)
        cv2.line(ink, begin, end, rng.uniform(120, 255), int(rng.integers(1, 5)), cv2.LINE_AA)
    if rng.random() < WORD_CHANCE:
        text = f"{int(rng.integers(1, 11))}. {rng.choice(WORDS)}"
        place = (round(rng.uniform(-0.1, 0.4) * columns), round(rng.uniform(0.02, 0.1) * rows))
        size, width = rng.uniform(0.6, 1.1) * columns / 512, int(rng.integers(1, 4))
        font = int(rng.choice((cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_DUPLEX)))
        cv2.putText(ink, text, place, font, size, rng.uniform(150, 255), width, cv2.LINE_AA)
    for _ in range(int(rng.integers(0, MOST_STROKES + 1))):
        stroke = _handwriting(shape, rng)
        cv2.polylines(ink, [stroke], False, rng.uniform(100, 255), int(rng.integers(2, 6)))
    soft = cv2.GaussianBlur(ink.astype(np.float32), (0, 0), rng.uniform(0.6, 1.1))
    return np.asarray(soft / 255, np.float32)


def _handwriting(shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.int32]:
    """Return the points of one stroke of a pen near the border, (steps, 1, 2)."""
    steps = int(rng.integers(*STROKE_STEPS))
    turns = np.cumsum(rng.normal(scale=STROKE_TURN, size=steps))
    headings = rng.uniform(0, 2 * np.pi) + np.cumsum(np.clip(turns, -0.6, 0.6))
    moves = STROKE_STEP * max(shape) * np.column_stack([np.cos(headings), np.sin(headings)])
    start = rng.uniform(0, 1, 2)
    axis = int(rng.integers(2))
    start[axis] = np.rint(start[axis]) + rng.normal(scale=0.06)
    path = start * shape[::-1] + np.cumsum(moves, axis=0)
    return np.asarray(np.rint(path)[:, None], np.int32)


INK_FLOOR: Final = 6.0  # grey level of the blackest ink
LIGHTEST_INK: Final = 0.35  # share of the contrast that the driest ridge keeps
RIM: Final = 0.55  # relief up to which ridges are darkest
LIGHTER_CREST: Final = (-0.2, 0.3)  # share of the contrast that their crests lack
GRAIN_PX, FIBRE_PX = 1.2, 1.8  # extent of the grain of ink, and of fibres
RESIDUE_EXTENT_PX: Final = 1.6
LIFTED: Final = 1.0  # threshold from which skin is off the glass
RESIDUE_REACH: Final = 8.0  # threshold at which residue has faded
RESIDUE_RARITY: Final = 2.3  # standard deviations of roughness above which a dot is left


def develop(
    relief: NDArray[np.floating],
    contact: Contact,
    sensor: Sensor,
    rng: np.random.Generator,
    stain: NDArray[np.floating] | float = 0.0,
    details: np.random.Generator | None = None,
) -> NDArray[np.uint8]:
    """Return the image (h, w) that a sensor takes of skin of height `relief`, with dark ridges.

    `stain` is the share of the glass that damp or grease covers, (h, w). With random numbers for
    `details`, the sensor has the settings and faults of one image.
    """
    import cv2  # noqa: PLC0415

    shape = sensor.shape
    height = contact.strength * relief + contact.grain - contact.threshold
    if details is not None:
        sensor = as_set(sensor, details)
        height -= sensor.needed
        height += sensor.speckle * details.standard_normal(shape, np.float32)
    covered = 1 / (1 + np.exp(-np.clip(height / sensor.softness, -30, 30)))
    covered = np.maximum(covered, _dust(sensor, rng))
    if sensor.residue > 0:
        covered = np.maximum(covered, _residue(contact, sensor, rng))
    covered = np.maximum(covered, stain)
    paper = _paper(sensor, rng)
    ink = sensor.ink + sensor.ink_variation * smooth_noise(shape, 25 * sensor.px, rng)
    ink += sensor.ink_fading * contact.threshold
    lightest = sensor.paper - LIGHTEST_INK * (sensor.paper - sensor.ink)
    np.clip(ink, INK_FLOOR, lightest, out=ink)
    spread = cv2.GaussianBlur(covered.astype(np.float32), (0, 0), sensor.blur * sensor.px)
    if details is not None:
        crest = np.clip((relief - RIM) / (1 - RIM), 0, 1)
        ink += details.uniform(*LIGHTER_CREST) * (sensor.paper - ink) * crest
        if sensor.ink_grain > 0:
            ink += sensor.ink_grain * smooth_noise(shape, GRAIN_PX * sensor.px, details)
        if sensor.fibres > 0:
            fibres = sensor.fibres * smooth_noise(shape, FIBRE_PX * sensor.px, details)
            ink += fibres
            paper += fibres
    grey = paper - spread * np.clip(paper - ink, 0, None)
    if details is not None and sensor.card:
        grey -= draw_card(shape, details) * np.clip(grey - sensor.ink, 0, None)
    grey += sensor.noise * rng.standard_normal(shape)
    grey = np.minimum(grey, sensor.ceiling)
    if sensor.frame > 0:
        grey += framed(sensor) * (sensor.ceiling - grey)
    image = np.asarray(np.clip(np.rint(grey), 0, 255), np.uint8)
    return image if details is None else _repeated(image, sensor.native, details)


def _repeated(
    image: NDArray[np.uint8], native: float, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return an image as if only `native` of its rows and columns had been taken."""
    if native >= 1:
        return image
    taken = []
    for side in image.shape:
        begin = rng.random()
        middle = (np.floor(np.arange(side) * native + begin) + 0.5 - begin) / native
        taken.append(np.clip(np.rint(middle), 0, side - 1).astype(np.intp))
    return np.asarray(image[np.ix_(*taken)])


def framed(sensor: Sensor) -> Field:
    """Return the share of each pixel, (h, w), behind a frame that cuts off the upper corners."""
    rows, columns = sensor.shape
    cut = sensor.frame * columns * np.linspace(1, 0, rows)[:, None]
    from_side = np.minimum(np.arange(columns), np.arange(columns)[::-1])
    return np.asarray(np.clip(cut - from_side, 0, 1), np.float32)


def _paper(sensor: Sensor, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the grey level of the bare glass."""
    rows, columns = sensor.shape
    y, x = np.linspace(-1, 1, rows)[:, None], np.linspace(-1, 1, columns)
    level = sensor.paper + sensor.exposure * rng.standard_normal()
    paper = np.full(sensor.shape, level)
    if sensor.vignette > 0:
        x0, y0 = rng.uniform(-0.15, 0.15, 2)
        paper -= sensor.vignette * (((x - x0) ** 2 + (y - y0) ** 2) / 2) ** 1.5
    if sensor.paper_variation > 0:
        paper += sensor.paper_variation * smooth_noise(sensor.shape, 45 * sensor.px, rng)
    if sensor.stripes > 0:
        wide = smooth_noise((1, columns), 25.0, rng)[0]
        paper += sensor.stripes * (wide + rng.standard_normal(columns))[None]
    return paper


def _dust(sensor: Sensor, rng: np.random.Generator) -> Field:
    """Return the dust on the glass, 0 to 1."""
    import cv2  # noqa: PLC0415

    specks = np.zeros(sensor.shape, np.float32)
    for _ in range(int(rng.integers(0, sensor.specks + 1))):
        centre = rng.integers(0, (sensor.width, sensor.height)).tolist()
        half_axes = rng.integers(1, 3, 2).tolist()
        tilt, strength = rng.uniform(0, 180), rng.uniform(0.2, 0.7)
        cv2.ellipse(specks, centre, half_axes, tilt, 0, 360, strength, -1)
    return np.asarray(cv2.GaussianBlur(specks, (0, 0), 0.7), np.float32)


def _residue(contact: Contact, sensor: Sensor, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the dots of residue around the print, 0 to 1, denser near it."""
    lifted = contact.threshold - LIFTED
    near = sensor.residue * np.exp(-np.clip(lifted, 0, None) / RESIDUE_REACH) * (lifted > 0)
    rough = smooth_noise(sensor.shape, RESIDUE_EXTENT_PX * sensor.px, rng)
    patchy = 0.4 * smooth_noise(sensor.shape, 30 * sensor.px, rng)
    return np.asarray(np.clip(rough + patchy + near - RESIDUE_RARITY, 0, 1) * np.minimum(near, 1))
