"""Polarity: whether a print shows its ridges white on black.

Ridges and valleys differ as lines (see `fpmatch.image.quality.line_cues`); the weights of these
cues were learned from synthetic prints by ``scripts/train_polarity``. One sensor has one polarity,
so the evidence of several images is summed. For a single image the background is weak evidence too.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import cv2
import numpy as np

from fpmatch.errors import FpmatchError, ImageError
from fpmatch.image.preprocess.percentiles import percentiles
from fpmatch.image.quality.line_cues import LINE_CUES, line_cues
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

Polarity = Literal["auto", "dark", "white"]
"""What the ridges of an image are; "auto": to be found."""

INVERTED: Final = "its ridges are white on black: turned into dark ones"
POLARITIES: Final[tuple[Polarity, ...]] = ("auto", "dark", "white")
WEIGHTS_FILE: Final = Path(__file__).with_name("polarity.json")


@dataclass(frozen=True, slots=True)
class PolarityParameters:
    """Set from where on a polarity is sure, and how the background is found.

    Parameters
    ----------
    sure : float
        Evidence, log-odds, from which on ridges are taken for white, or a folder's for dark.
    background_odds : float
        Log-odds that the background of a single image adds, where it is as bright as the bright
        lines, or takes off, where it is as dark as the dark ones.
    strongest : float
        Evidence of one image beyond which more does not count.
    farthest : float
        Cue, in units of its usual size, beyond which more does not count.
    max_px : int
        Pixels at 500 dpi above which an image is no print and gives no evidence.
    step_px : int
        Every second, third or whatever pixel is looked at for the background.
    block_px : int
        Side of the blocks that are looked at, in these pixels.
    strong_percentile : float
        Percentile of the blocks' deviations that stands for the print's contrast.
    print_contrast, quiet_contrast : float
        Share of that contrast above which a block is print, and below which it is background.
    min_contrast : float
        Deviation in grey levels below which there is no print.
    min_print, min_background : float
        Share of the blocks that must be print, and background.
    line_percentiles : tuple of float
        Percentiles of the print's grey values that stand for its dark and its bright lines.
    clear_level : float
        Level, from -1 of the dark lines to 1 of the bright ones, from which on a background is
        clearly bright.
    max_other : float
        Share of the background that may be of the other half of the grey levels.
    """

    sure: float = 4.0
    background_odds: float = 3.0
    strongest: float = 8.0
    farthest: float = 4.0
    max_px: int = 16_000_000
    step_px: int = 2
    block_px: int = 8
    strong_percentile: float = 90.0
    print_contrast: float = 0.5
    quiet_contrast: float = 0.15
    min_contrast: float = 8.0
    min_print: float = 0.05
    min_background: float = 0.02
    line_percentiles: tuple[float, float] = (10.0, 90.0)
    clear_level: float = 0.2
    max_other: float = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class PolarityWeights:
    """Hold what was learned: usual size and weight of each of `LINE_CUES`.

    There is no constant term: the evidence of a negative is that of the image with the other sign.
    """

    spread: NDArray[np.float64]
    weight: NDArray[np.float64]
    provenance: Mapping[str, Any]

    def evidence(
        self, cues: NDArray[np.float64], parameters: PolarityParameters | None = None
    ) -> NDArray[np.float64]:
        """Return the log-odds that ridges are dark, of cues of shape (..., 7)."""
        p = parameters or PolarityParameters()
        total = np.clip(cues / self.spread, -p.farthest, p.farthest) @ self.weight
        return np.asarray(np.clip(total, -p.strongest, p.strongest))

    def as_json(self) -> str:
        """Return the weights as the text of a JSON file."""
        rows = zip(LINE_CUES, self.spread.tolist(), self.weight.tolist(), strict=True)
        cues = [{"name": name, "spread": spread, "weight": weight} for name, spread, weight in rows]
        return f"{json.dumps({'provenance': self.provenance, 'cues': cues}, indent=1)}\n"

    @classmethod
    def from_json(cls, text: str) -> PolarityWeights:
        """Read what `as_json` wrote.

        Raises
        ------
        FpmatchError
            If the text is no such thing, or its cues are others than `LINE_CUES`.
        """
        try:
            document = json.loads(text)
            rows = document["cues"]
            if tuple(row["name"] for row in rows) != LINE_CUES:
                raise FpmatchError("weights of the polarity: of other cues than this version's")
            spread, weight = (
                np.array([float(row[key]) for row in rows]) for key in ("spread", "weight")
            )
            return cls(spread, weight, document["provenance"])
        except (LookupError, TypeError, ValueError) as error:
            raise FpmatchError("weights of the polarity: not such a file") from error


@cache
def load_polarity_weights() -> PolarityWeights:
    """Return the weights in the package."""
    return PolarityWeights.from_json(WEIGHTS_FILE.read_text(encoding="utf-8"))


def polarity_evidence(
    grey: NDArray[np.uint8],
    dpi: float = STANDARD_DPI,
    parameters: PolarityParameters | None = None,
) -> float:
    """Return by how much the lines of an image speak for dark ridges rather than white ones.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Image.
    dpi : float
        Its resolution.
    parameters : PolarityParameters, optional
        Limits.

    Returns
    -------
    float
        Log-odds: positive for dark ridges, negative for white ones, 0 where there is nothing to
        tell by. That of the negative is the same with the other sign.

    Examples
    --------
    >>> polarity_evidence(np.full((200, 200), 255, np.uint8))
    0.0
    """
    p = parameters or PolarityParameters()
    at_500_dpi = _resampled(grey, dpi, p.max_px)
    cues = None if at_500_dpi is None else line_cues(at_500_dpi)
    return 0.0 if cues is None else float(load_polarity_weights().evidence(cues, p))


def is_inverted(
    grey: NDArray[np.uint8],
    dpi: float = STANDARD_DPI,
    parameters: PolarityParameters | None = None,
) -> bool:
    """Tell whether a single print shows white ridges.

    A clearly bright background, as most sensors of dark ridges have, spares the closer look.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Image.
    dpi : float
        Its resolution.
    parameters : PolarityParameters, optional
        Limits.

    Returns
    -------
    bool
        True only where it is sure.

    Examples
    --------
    >>> is_inverted(np.full((200, 200), 255, np.uint8))
    False
    """
    p = parameters or PolarityParameters()
    background = background_level(grey, p)
    if background > p.clear_level:
        return False
    return polarity_evidence(grey, dpi, p) + p.background_odds * background <= -p.sure


def common_polarity(
    evidence: Sequence[float], parameters: PolarityParameters | None = None
) -> Polarity:
    """Return the polarity of images of one sensor.

    Parameters
    ----------
    evidence : sequence of float
        Of each image, by `polarity_evidence`.
    parameters : PolarityParameters, optional
        From where on it is sure.

    Returns
    -------
    str
        "dark" or "white"; "auto" where the sum, over the root of their number as they are not
        independent, is not sure.

    Examples
    --------
    >>> common_polarity([-3.0, -5.0, 1.0]), common_polarity([3.0, -3.0]), common_polarity([])
    ('white', 'auto', 'auto')
    """
    p = parameters or PolarityParameters()
    total = math.fsum(evidence) / math.sqrt(max(len(evidence), 1))
    return "white" if total <= -p.sure else "dark" if total >= p.sure else "auto"


def check_polarity(polarity: object) -> Polarity:
    """Return a polarity that is one of `POLARITIES`.

    Raises
    ------
    ImageError
        If it is none.
    """
    for known in POLARITIES:
        if polarity == known:
            return known
    raise ImageError(f"no polarity {polarity!r}: there are {', '.join(POLARITIES)}")


def background_level(
    grey: NDArray[np.uint8], parameters: PolarityParameters | None = None
) -> float:
    """Return how bright the background of a print is, compared with its lines.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Image.
    parameters : PolarityParameters, optional
        How it is found.

    Returns
    -------
    float
        -1 for that of the dark lines or darker, 1 for that of the bright ones or brighter; 0 where
        there is no background, or it is of both kinds.

    Examples
    --------
    >>> waves = 128 + 100 * np.cos(np.arange(96) * 0.7)
    >>> image = np.full((160, 160), 250, np.uint8)
    >>> image[32:128, 32:128] = waves
    >>> background_level(image), background_level(255 - image)
    (1.0, -1.0)
    """
    p = parameters or PolarityParameters()
    blocks = _blocks(grey[:: p.step_px, :: p.step_px], p.block_px)
    if not len(blocks):
        return 0.0
    deviation = blocks.std(axis=1)
    contrast = float(percentiles(deviation, p.strong_percentile)[0])
    print_ = deviation > p.print_contrast * contrast
    quiet = deviation < p.quiet_contrast * contrast
    if contrast < p.min_contrast or print_.mean() < p.min_print or quiet.mean() < p.min_background:
        return 0.0
    dark, bright = percentiles(blocks[print_].ravel(), *p.line_percentiles)
    middle = percentiles(blocks[quiet], 50)[0]
    levels = 2 * (middle - dark) / max(bright - dark, 1.0) - 1
    level = float(np.clip(percentiles(levels, 50)[0], -1, 1))
    other = float((np.sign(levels) == -np.sign(level)).mean())
    return level if other <= p.max_other else 0.0


def _blocks(grey: NDArray[np.uint8], side: int) -> NDArray[np.float32]:
    """Return the whole blocks of an image, shape (N, side * side)."""
    rows, columns = grey.shape[0] // side, grey.shape[1] // side
    whole = grey[: rows * side, : columns * side].astype(np.float32)
    return whole.reshape(rows, side, columns, side).swapaxes(1, 2).reshape(-1, side * side)


def _resampled(grey: NDArray[np.uint8], dpi: float, max_px: int) -> NDArray[np.uint8] | None:
    """Return an image at 500 dpi, about; None where it is too large for a print."""
    zoom = STANDARD_DPI / dpi
    width, height = (max(1, round(side * zoom)) for side in grey.shape[::-1])
    if width * height > max_px:
        return None
    if abs(zoom - 1) < 0.01:
        return grey
    interpolation = cv2.INTER_AREA if zoom < 1 else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(grey, (width, height), interpolation=interpolation), np.uint8)
