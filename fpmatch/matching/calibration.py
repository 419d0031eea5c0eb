"""Calibration: from a matcher's raw similarity to the score ``-10 * log10(FMR)``.

A calibration is a curve. Up to the largest measured score it consists of knots, measured on
impostor comparisons, and straight lines between them. Beyond, it is a generalised Pareto tail: with
excess e = (x - last knot) / scale and shape ξ ≥ 0, the FMR falls as (1 + ξ·e)^(-1/ξ), or as exp(-e)
where ξ is 0. `fpmatch.lab.evaluation.calibrate` fits one; ``python -m research calibrate``
makes the calibrations of the package. The highest knots of the default matcher's, and its tail, are
measured on pairs of synthetic templates.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.parsing import parse_json
from fpmatch.errors import MatcherError, number_text

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

MAX_SCORE: Final = 100.0
CALIBRATION_FOLDER: Final = Path(__file__).with_name("calibration_data")
FILES: Final = {"paper": "paper", "reference": "unit-circle", "unit-circle": "unit-circle"}
_RHO: Final = re.compile("[:,]rho=[^,]*")  # in the name of a matcher
_DECIBEL: Final = 10.0 / math.log(10.0)  # score units a factor of e in FMR


@dataclass(frozen=True, slots=True)
class Calibration:
    """Map a matcher's similarity to its score, 0 to 100; increasing from the first knot on.

    Parameters
    ----------
    knots : tuple of (float, float)
        Points (similarity, score) of the empirical part, both strictly increasing.
    tail_scale : float
        Scale of the tail's generalised Pareto distribution at the last knot, in similarity.
    tail_shape : float
        Its shape, not negative; 0 is an exponential tail.
    provenance : mapping
        Where it comes from: names of the databases (``sets``), numbers of their ``impostors`` and
        ``fingers`` (0 where unknown), ``version`` and ``command`` that fitted it, the ``matcher``
        whose similarities it is for, and the pairs (``tail``) that measured the knots above the
        score ``tail_from``, and the tail.

    Raises
    ------
    MatcherError
        If the knots do not increase or a value is out of range.

    Examples
    --------
    >>> import math
    >>> from fpmatch.matching.calibration import Calibration
    >>> ten_per_unit = Calibration(((0.0, 0.0), (2.0, 20.0)), tail_scale=10 / math.log(10) / 10)
    >>> [round(ten_per_unit.score(x), 6) for x in (-1.0, 1.5, 4.0, 50.0)]
    [0.0, 15.0, 40.0, 100.0]
    """

    knots: tuple[tuple[float, float], ...]
    tail_scale: float
    tail_shape: float = 0.0
    provenance: Mapping[str, Any] = field(default_factory=dict, hash=False)
    _columns: NDArray[np.float64] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        knots = np.array(self.knots, dtype=np.float64)
        if knots.ndim != 2 or knots.shape[1] != 2 or not np.isfinite(knots).all():
            raise MatcherError("calibration: knots must be pairs (similarity, score), finite")
        if (np.diff(knots, axis=0) <= 0).any() or (knots[:, 1] < 0).any():
            raise MatcherError("calibration: knots must increase, from a score of 0 or more")
        if not (0 < self.tail_scale < math.inf and 0 <= self.tail_shape < math.inf):
            raise MatcherError("calibration: the tail must have a positive scale, a shape from 0")
        object.__setattr__(self, "_columns", np.ascontiguousarray(knots.T))

    @property
    def largest_measured_score(self) -> float:
        """Score up to which the impostor data reach; what lies above is extrapolated."""
        return self.knots[-1][1]

    def score(self, similarity: float) -> float:
        """Return the score of one similarity."""
        return float(self.scores(similarity))

    def scores(self, similarities: ArrayLike) -> NDArray[np.float64]:
        """Return the scores of similarities of any shape, as float64."""
        x = np.asarray(similarities, dtype=np.float64)
        knot_x, knot_score = self._columns
        inner = np.interp(x, knot_x, knot_score)
        with np.errstate(over="ignore"):  # infinitely far out on a very thin tail is MAX_SCORE
            excess = np.maximum(x - knot_x[-1], 0.0) / self.tail_scale
        if self.tail_shape > 0:
            excess = np.log1p(self.tail_shape * excess) / self.tail_shape
        clipped: NDArray[np.float64] = np.clip(inner + _DECIBEL * excess, 0.0, MAX_SCORE)
        return clipped

    def as_json(self) -> str:
        """Return the calibration as the text of a JSON file."""
        names = "provenance", "tail_scale", "tail_shape", "knots"
        entries = asdict(self)
        return json.dumps({name: entries[name] for name in names}, indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str, source: str = "calibration") -> Calibration:
        """Read what `as_json` wrote to the file `source`; raise MatcherError if it did not."""
        try:
            entries = parse_json(text)
            return cls(
                knots=tuple((float(x), float(score)) for x, score in entries["knots"]),
                tail_scale=float(entries["tail_scale"]),
                tail_shape=float(entries["tail_shape"]),
                provenance=dict(entries["provenance"]),
            )
        except MatcherError as error:
            raise MatcherError(f"{source}: {error}") from error
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:
            raise MatcherError(f"{source}: not a calibration file") from error


def load_calibration(matcher_name: str, file: str | os.PathLike[str] | None = None) -> Calibration:
    """Return the calibration for a matcher: that of a file, else the one in the package.

    The parameter `rho` of a matcher, which alters no similarity, is disregarded.

    Parameters
    ----------
    matcher_name : str
        The matcher.
    file : path, optional
        What ``fpmatch calibrate`` wrote; read at each call.

    Raises
    ------
    MatcherError
        If the file cannot be read, is no calibration or one for another matcher; if, without a
        file, the package has none for this matcher.

    Examples
    --------
    >>> from fpmatch.matching.calibration import load_calibration
    >>> load_calibration("unit-circle").provenance["impostors"] > 1000
    True
    """
    if file is None:
        return _calibration_of_package(matcher_name)
    try:
        text = Path(file).read_text(encoding="utf-8")
    except OSError as error:
        raise MatcherError(f"{file}: cannot be read: {(error.strerror or '').lower()}") from error
    except UnicodeDecodeError as error:
        raise MatcherError(f"{file}: not a calibration file") from error
    calibration = Calibration.from_json(text, str(file))
    made_for = str(calibration.provenance.get("matcher", ""))
    if made_for and _RHO.sub("", made_for) != _RHO.sub("", matcher_name):
        raise MatcherError(f"{file}: calibrates matcher {made_for!r}, not {matcher_name!r}")
    return calibration


@cache
def _calibration_of_package(matcher_name: str) -> Calibration:
    name = _RHO.sub("", matcher_name)
    if name not in FILES:
        usual = matcher_name.partition(":")[0]
        other = f" (that of {usual} is for its usual parameters)" * (usual in FILES)
        raise MatcherError(
            f"matcher {matcher_name!r} has no calibration{other}; see fpmatch calibrate"
        )
    file = CALIBRATION_FOLDER / f"{FILES[name]}.json"
    return Calibration.from_json(file.read_text(encoding="utf-8"), file.name)


def is_calibrated(matcher_name: str) -> bool:
    """Return whether the package has a calibration for a matcher, with the parameters it has."""
    return _RHO.sub("", matcher_name) in FILES


def score_to_fmr(score: float) -> float:
    """Return the false match rate that a score stands for: ``10 ** (-score / 10)``.

    Raises
    ------
    MatcherError
        If `score` is not from 0 to 100.

    Examples
    --------
    >>> from fpmatch import score_to_fmr
    >>> score_to_fmr(40.0)
    0.0001
    """
    if not 0.0 <= score <= MAX_SCORE:
        raise MatcherError(f"a score lies from 0 to {MAX_SCORE:g}, not {number_text(score)}")
    return float(10.0 ** (-score / 10.0))


def fmr_to_score(fmr: float) -> float:
    """Return the score at which the false match rate is `fmr`: ``-10 * log10(fmr)``.

    Raises
    ------
    MatcherError
        If `fmr` is not from 1e-10 to 1.

    Examples
    --------
    >>> from fpmatch import fmr_to_score
    >>> fmr_to_score(0.0001)
    40.0
    """
    lowest = 10.0 ** (-MAX_SCORE / 10.0)
    if not lowest <= fmr <= 1.0:
        raise MatcherError(f"a false match rate lies from {lowest:g} to 1, not {number_text(fmr)}")
    return float(-10.0 * math.log10(fmr)) + 0.0  # + 0.0 turns -0.0 into 0.0


def allowance(share: float, tries: int = 1) -> float:
    """Return by how much the score of each of some tries is lowered, at least one.

    Together they have `share` of the false match rate.

    Examples
    --------
    >>> round(allowance(0.1), 6), round(allowance(0.5, 5), 6)
    (10.0, 10.0)
    """
    return 10.0 * math.log10(max(tries, 1) / share)
