"""Agreement of minutia directions with those that other extractors find on the same prints.

No extractor's set is the truth, but all keep one convention (ISO/IEC 19794-2): where two find a
minutia in one place, a direction that most often differs is a convention misunderstood, and one
that often points the other way has endings and bifurcations, or ridges and valleys, mixed up.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError, MinutiaeError
from fpmatch.minutiae import Minutiae
from fpmatch.pointset.pairing import greedy_pairs

if TYPE_CHECKING:
    import os

    from fpmatch.evaluation.extraction import ExtractedSet

_COLUMNS: Final = ("x", "y", "theta")


@dataclass(frozen=True, slots=True)
class AgreementParameters:
    """Set what counts as the same minutia, as agreement and as a flip."""

    max_distance_px: float = 8.0
    max_turn_deg: float = 30.0
    min_flip_deg: float = 150.0


@dataclass(frozen=True, slots=True)
class Agreement:
    """Count pairs of minutiae in one place, found by two extractors; counts add up.

    Parameters
    ----------
    pairs : int
        Minutiae that both found, one to one.
    agreeing : int
        Those whose directions agree.
    flipped : int
        Those whose directions are opposite.
    """

    pairs: int = 0
    agreeing: int = 0
    flipped: int = 0

    def __add__(self, other: Agreement) -> Agreement:
        return Agreement(
            self.pairs + other.pairs,
            self.agreeing + other.agreeing,
            self.flipped + other.flipped,
        )

    @property
    def agreeing_share(self) -> float:
        """Share of the pairs that agree; NaN without pairs."""
        return self.agreeing / self.pairs if self.pairs else float("nan")

    @property
    def flipped_share(self) -> float:
        """Share of the pairs that are flipped; NaN without pairs."""
        return self.flipped / self.pairs if self.pairs else float("nan")


def compare_directions(
    ours: Minutiae, theirs: Minutiae, parameters: AgreementParameters | None = None
) -> Agreement:
    """Compare the directions of the minutiae that two extractors found in one place.

    Parameters
    ----------
    ours, theirs : Minutiae
        Minutiae of one image, in its pixels.
    parameters : AgreementParameters, optional
        Limits.

    Returns
    -------
    Agreement
        Over the nearest pairs, one to one.

    Examples
    --------
    >>> ours = Minutiae(x=[10, 50], y=[10, 50], angle=[0.0, 1.0])
    >>> theirs = Minutiae(x=[12, 51, 90], y=[10, 50, 90], angle=[0.1, 1.0 + np.pi, 0.0])
    >>> compare_directions(ours, theirs)
    Agreement(pairs=2, agreeing=1, flipped=1)
    """
    p = parameters or AgreementParameters()
    if not (len(ours) and len(theirs)):
        return Agreement()
    i, j = greedy_pairs(ours.xy, theirs.xy, p.max_distance_px).T
    difference = np.degrees(ours.angle[i].astype(np.float64) - theirs.angle[j])
    turn = np.abs((difference + 180.0) % 360.0 - 180.0)
    return Agreement(
        pairs=len(turn),
        agreeing=int(np.count_nonzero(turn <= p.max_turn_deg)),
        flipped=int(np.count_nonzero(turn > p.min_flip_deg)),
    )


def measure_agreement(
    prints: ExtractedSet,
    folder: str | os.PathLike[str],
    parameters: AgreementParameters | None = None,
) -> Agreement:
    """Measure the agreement on a whole database with another extractor's minutiae.

    Parameters
    ----------
    prints : ExtractedSet
        The database and our templates; prints that gave none add nothing.
    folder : path
        Holds a file ``FFF_M.csv`` for each impression, as `read_minutiae` reads it.
    parameters : AgreementParameters, optional
        Limits.

    Returns
    -------
    Agreement
        Over all impressions together.

    Raises
    ------
    DatasetError
        If a file is missing or malformed.
    """
    total = Agreement()
    for impression, extraction in zip(prints.dataset.impressions, prints.extractions, strict=True):
        theirs = read_minutiae(Path(folder, f"{impression.path.stem}.csv"))
        if extraction.template is not None:
            total += compare_directions(extraction.template.minutiae, theirs, parameters)
    return total


def read_minutiae(path: str | os.PathLike[str]) -> Minutiae:
    """Read minutiae from a CSV file with columns x, y, theta and perhaps more.

    Parameters
    ----------
    path : path
        x and y in pixels of the image, theta in degrees counter-clockwise on screen from +x.

    Returns
    -------
    Minutiae
        Positions and directions; kinds and qualities, which no two extractors share, are left out.

    Raises
    ------
    DatasetError
        If the file is missing or malformed.
    """
    try:
        with Path(path).open(newline="", encoding="utf-8") as stream:
            rows = [[float(row[name]) for name in _COLUMNS] for row in csv.DictReader(stream)]
        x, y, theta = np.array(rows, dtype=np.float64).reshape(-1, len(_COLUMNS)).T
        return Minutiae(x, y, np.radians(theta))  # type: ignore[arg-type]
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {error.strerror}") from error
    except KeyError as error:
        raise DatasetError(f"{path}: has no column {error}") from error
    except (TypeError, ValueError, csv.Error, MinutiaeError) as error:
        raise DatasetError(f"{path}: not a table of minutiae ({error})") from error
