"""Agreement of minutia directions with those that other extractors find on the same prints.

No extractor's set is the truth, but all use one convention (ISO/IEC 19794-2). Where two find a
minutia in one place, directions that mostly differ show a wrong convention, and many opposite ones
show that endings and bifurcations, or ridges and valleys, are confused.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.formats.files import load_record
from fpmatch.pointset.geometry.pairing import greedy_pairs

if TYPE_CHECKING:
    import os

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.templates.minutiae import Minutiae

MAX_DISTANCE_PX: Final = 8.0  # between positions of the same minutia
MAX_TURN_DEG: Final = 30.0  # between directions that agree
MIN_FLIP_DEG: Final = 150.0  # between opposite directions


@dataclass(frozen=True, slots=True)
class Agreement:
    """Count minutiae that two extractors found in one place; counts add up.

    `pairs`: minutiae that both found, one to one. `agreeing`, `flipped`: pairs whose directions
    agree, and whose directions are opposite.
    """

    pairs: int = 0
    agreeing: int = 0
    flipped: int = 0

    def __add__(self, other: Agreement) -> Agreement:
        return Agreement(
            self.pairs + other.pairs, self.agreeing + other.agreeing, self.flipped + other.flipped
        )

    @property
    def agreeing_share(self) -> float:
        """Share of the pairs that agree; NaN without pairs."""
        return self.agreeing / self.pairs if self.pairs else float("nan")

    @property
    def flipped_share(self) -> float:
        """Share of the pairs that are flipped; NaN without pairs."""
        return self.flipped / self.pairs if self.pairs else float("nan")


def compare_directions(ours: Minutiae, theirs: Minutiae) -> Agreement:
    """Compare the directions of minutiae of one image that two extractors found in one place."""
    if not (len(ours) and len(theirs)):
        return Agreement()
    i, j = greedy_pairs(ours.xy, theirs.xy, MAX_DISTANCE_PX).T
    difference = np.degrees(ours.angle[i].astype(np.float64) - theirs.angle[j])
    turn = np.abs((difference + 180.0) % 360.0 - 180.0)
    agreeing, flipped = turn <= MAX_TURN_DEG, turn > MIN_FLIP_DEG
    return Agreement(len(turn), int(agreeing.sum()), int(flipped.sum()))


def measure_agreement(prints: ExtractedSet, folder: str | os.PathLike[str]) -> Agreement:
    """Measure the agreement on a database with another extractor's minutiae, a CSV file a print."""
    total = Agreement()
    for impression, extraction in zip(prints.dataset.impressions, prints.extractions, strict=True):
        path = Path(folder, f"{impression.path.stem}.csv")
        theirs = load_record(path, file_format="minutiae-csv").single().template.minutiae
        if extraction.template is not None:
            total += compare_directions(extraction.template.minutiae, theirs)
    return total
