"""What a matcher's raw similarity is worth: the score ``-10 * log10(FMR)``.

A calibration is measured on impostor comparisons, by `fit_calibration`:

- *Where impostors reach*, the FMR at a similarity x is the share of impostors at x or above it.
  Knots, at most half a unit of score apart, keep this curve; between knots it is linear.
- *Beyond*, where fewer than `CalibrationParameters.min_above` impostors are left, the excesses
  over a high similarity follow a generalised Pareto distribution: the limit that the tails of
  nearly all distributions approach (Pickands 1975). Its shape is held at 0 (exponential tail,
  the score grows linearly) or above (heavy tail, the score grows ever more slowly): a tail that
  ends would grant unlimited scores just above the highest impostor seen.

References
----------
Pickands, "Statistical inference using extreme order statistics", Annals of Statistics 3 (1975).
Hosking, Wallis, "Parameter and quantile estimation for the generalized Pareto distribution",
Technometrics 29 (1987), for the fit by probability-weighted moments.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

MAX_SCORE: Final = 100.0
CALIBRATION_FOLDER: Final = Path(__file__).with_name("calibration_data")
_DECIBEL: Final = 10.0 / math.log(10.0)  # score units a factor of e in FMR
_DIGITS: Final = 9  # significant digits kept, so that files do not differ by rounding


@dataclass(frozen=True, slots=True)
class CalibrationParameters:
    """Hold what `fit_calibration` may be told.

    Parameters
    ----------
    min_impostors : int
        Fewer impostor comparisons than this are refused.
    min_above : int
        The empirical curve ends where fewer impostors than this lie at or above.
    tail_share : float
        Share of the impostors, the highest, to which the tail is fitted.
    min_tail : int
        The tail is fitted to at least this many impostors.
    max_shape : float
        Upper limit of the tail's shape; 0.5, where the variance becomes infinite, is far more
        than similarities show, and keeps the fit of a small sample in hand.
    knot_step : float
        Greatest distance between knots in score.
    """

    min_impostors: int = 1000
    min_above: int = 20
    tail_share: float = 0.01
    min_tail: int = 100
    max_shape: float = 0.5
    knot_step: float = 0.5


@dataclass(frozen=True, slots=True)
class Provenance:
    """Hold where a calibration comes from: set names, impostor comparisons, version, command."""

    sets: tuple[str, ...] = ()
    impostors: int = 0
    version: str = ""
    command: str = ""


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
    provenance : Provenance
        Where it comes from.

    Raises
    ------
    MatcherError
        If the knots do not increase or a value is out of range.

    Examples
    --------
    >>> ten_per_unit = Calibration(((0.0, 0.0), (2.0, 20.0)), tail_scale=10 / math.log(10) / 10)
    >>> [round(ten_per_unit.score(x), 6) for x in (-1.0, 1.5, 4.0, 50.0)]
    [0.0, 15.0, 40.0, 100.0]
    """

    knots: tuple[tuple[float, float], ...]
    tail_scale: float
    tail_shape: float = 0.0
    provenance: Provenance = Provenance()

    def __post_init__(self) -> None:
        knots = np.array(self.knots, dtype=np.float64)
        if knots.ndim != 2 or knots.shape[1] != 2 or not np.isfinite(knots).all():
            raise MatcherError("calibration: knots must be pairs (similarity, score), finite")
        if (np.diff(knots, axis=0) <= 0).any() or (knots[:, 1] < 0).any():
            raise MatcherError("calibration: knots must increase, from a score of 0 or more")
        if not (math.isfinite(self.tail_scale) and self.tail_scale > 0):
            raise MatcherError("calibration: the tail's scale must be positive")
        if not (math.isfinite(self.tail_shape) and self.tail_shape >= 0):
            raise MatcherError("calibration: the tail's shape must not be negative")

    def score(self, similarity: float) -> float:
        """Return the score of one similarity."""
        return float(self.scores(similarity))

    def scores(self, similarities: ArrayLike) -> NDArray[np.float64]:
        """Return the scores of similarities of any shape, as float64."""
        x = np.asarray(similarities, dtype=np.float64)
        knot_x, knot_score = np.array(self.knots).T
        inner = np.interp(x, knot_x, knot_score)
        with np.errstate(over="ignore"):  # infinitely far out on a very thin tail is MAX_SCORE
            excess = np.maximum(x - knot_x[-1], 0.0) / self.tail_scale
        if self.tail_shape > 0:
            excess = np.log1p(self.tail_shape * excess) / self.tail_shape
        clipped: NDArray[np.float64] = np.clip(inner + _DECIBEL * excess, 0.0, MAX_SCORE)
        return clipped

    def as_json(self) -> str:
        """Return the calibration as the text of a JSON file."""
        entries = {
            "provenance": {
                "sets": list(self.provenance.sets),
                "impostors": self.provenance.impostors,
                "version": self.provenance.version,
                "command": self.provenance.command,
            },
            "tail_scale": self.tail_scale,
            "tail_shape": self.tail_shape,
        }
        knots = ",\n".join(f"    {json.dumps(knot)}" for knot in self.knots)
        return f'{json.dumps(entries, indent=2)[:-2]},\n  "knots": [\n{knots}\n  ]\n}}\n'

    @classmethod
    def from_json(cls, text: str, source: str = "calibration") -> Calibration:
        """Read what `as_json` wrote.

        Parameters
        ----------
        text : str
            The text of the file.
        source : str
            Name of the file, for the message of an error.

        Returns
        -------
        Calibration
            Equal to the one that was written.

        Raises
        ------
        MatcherError
            If the text is not JSON, an entry is missing, or a value is out of range.
        """
        try:
            return _from_entries(json.loads(text))
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise MatcherError(f"{source}: not a calibration file") from error
        except MatcherError as error:
            raise MatcherError(f"{source}: {error}") from error


def fit_calibration(
    impostor_similarities: ArrayLike,
    *,
    parameters: CalibrationParameters = CalibrationParameters(),
    provenance: Provenance = Provenance(),
) -> Calibration:
    """Fit a calibration to the similarities of impostor comparisons.

    Parameters
    ----------
    impostor_similarities : array_like of float, shape (N,)
        Similarities of comparisons of different fingers.
    parameters : CalibrationParameters
        How to fit.
    provenance : Provenance
        Where the similarities come from, kept as it is.

    Returns
    -------
    Calibration
        The fit; the same for the same similarities in any order.

    Raises
    ------
    MatcherError
        If there are too few similarities, too few distinct ones, or one is not finite.

    Examples
    --------
    >>> unit_tail = np.random.default_rng(1).exponential(size=20_000)
    >>> fit_calibration(unit_tail).score(math.log(1000)).__round__()
    30
    """
    s = np.sort(np.asarray(impostor_similarities, dtype=np.float64).ravel())
    if not np.isfinite(s).all():
        raise MatcherError("calibration: impostor similarities must be finite numbers")
    if s.size < parameters.min_impostors:
        raise MatcherError(
            f"calibration: {s.size} impostor comparisons are too few; "
            f"at least {parameters.min_impostors} are needed"
        )
    knots = _empirical_knots(s, parameters)
    scale, shape = _tail_at(knots[-1][0], s, parameters)
    return Calibration(knots, _rounded(scale), _rounded(shape), provenance)


@cache
def load_calibration(matcher_name: str) -> Calibration:
    """Return the calibration that comes with the package for a matcher.

    Raises
    ------
    MatcherError
        If the package has none for it, or the file is damaged.
    """
    if matcher_name not in calibrated_matchers():
        raise MatcherError(f"matcher {matcher_name!r} has no calibration; see scripts/calibrate")
    file = CALIBRATION_FOLDER / f"{matcher_name}.json"
    return Calibration.from_json(file.read_text(encoding="utf-8"), file.name)


def calibrated_matchers() -> list[str]:
    """Return the names of the matchers for which the package has a calibration."""
    return sorted(file.stem for file in CALIBRATION_FOLDER.glob("*.json"))


def score_to_fmr(score: float) -> float:
    """Return the false match rate that a score stands for: ``10 ** (-score / 10)``.

    Raises
    ------
    MatcherError
        If `score` is not from 0 to 100.

    Examples
    --------
    >>> score_to_fmr(40.0)
    0.0001
    """
    if not 0.0 <= score <= MAX_SCORE:
        raise MatcherError(f"a score lies from 0 to {MAX_SCORE:g}, not {score:g}")
    return float(10.0 ** (-score / 10.0))


def fmr_to_score(fmr: float) -> float:
    """Return the score at which the false match rate is `fmr`: ``-10 * log10(fmr)``.

    Raises
    ------
    MatcherError
        If `fmr` is not from 1e-10 to 1.

    Examples
    --------
    >>> fmr_to_score(0.0001)
    40.0
    """
    lowest = 10.0 ** (-MAX_SCORE / 10.0)
    if not lowest <= fmr <= 1.0:
        raise MatcherError(f"a false match rate lies from {lowest:g} to 1, not {fmr:g}")
    return float(-10.0 * math.log10(fmr)) + 0.0  # + 0.0 turns -0.0 into 0.0


def _empirical_knots(
    s: NDArray[np.float64], parameters: CalibrationParameters
) -> tuple[tuple[float, float], ...]:
    """Return knots of the curve x -> -10 log10(share of impostors at or above x); s is sorted."""
    x, first = np.unique(s, return_index=True)
    above = s.size - first
    kept = above >= min(parameters.min_above, s.size)
    x, score = x[kept], -10.0 * np.log10(above[kept] / s.size) + 0.0
    steps = np.arange(0.0, score[-1], parameters.knot_step)
    chosen = np.searchsorted(score, steps)
    # Two knots keep a jump of the curve a jump, not a slope from the knot before.
    jumps = 1 + np.flatnonzero(np.diff(score) > parameters.knot_step)
    index = np.unique(np.concatenate([chosen, jumps - 1, jumps, [score.size - 1]]))
    knots = [(_rounded(x[index[0]]), _rounded(score[index[0]]))]
    for k in index[1:]:
        knot = (_rounded(x[k]), _rounded(score[k]))
        if knot[0] > knots[-1][0]:
            knots.append(knot)
    return tuple(knots)


def _tail_at(
    last: float, s: NDArray[np.float64], parameters: CalibrationParameters
) -> tuple[float, float]:
    """Return scale and shape of the generalised Pareto tail above the similarity `last`.

    Excesses over a higher threshold keep the shape, and the scale grows by shape times the rise.
    """
    count = max(parameters.min_tail, round(parameters.tail_share * s.size))
    start = s[-min(count + 1, s.size)]
    excess = s[s > start] - start
    if not excess.size:
        raise MatcherError(
            "calibration: the highest impostor similarities are all the same; no tail can be fitted"
        )
    scale, shape = _fit_pareto(excess, parameters.max_shape)
    return scale + shape * max(last - start, 0.0), shape


def _fit_pareto(excess: NDArray[np.float64], max_shape: float) -> tuple[float, float]:
    """Fit scale and shape (in Hosking and Wallis's sign, -k) to sorted positive excesses.

    With α0 the mean and α1 the mean of x·(1 - F(x)), the moments give k = α0/(α0 - 2α1) - 2 and
    scale = 2·α0·α1/(α0 - 2α1). Where the shape -k leaves 0..max_shape it is held at that limit,
    and the scale is what then gives the mean: α0·(1 - shape).
    """
    n = excess.size
    mean = float(excess.mean())
    weighted = float(excess @ (np.arange(n - 1, -1, -1) / max(n - 1, 1))) / n
    spread = mean - 2.0 * weighted
    shape = 2.0 - mean / spread if spread > 0 else 0.0
    shape = min(max(shape, 0.0), max_shape)
    return mean * (1.0 - shape), shape


def _from_entries(entries: dict[str, Any]) -> Calibration:
    origin = entries["provenance"]
    return Calibration(
        knots=tuple((float(x), float(score)) for x, score in entries["knots"]),
        tail_scale=float(entries["tail_scale"]),
        tail_shape=float(entries["tail_shape"]),
        provenance=Provenance(
            sets=tuple(map(str, origin["sets"])),
            impostors=int(origin["impostors"]),
            version=str(origin["version"]),
            command=str(origin["command"]),
        ),
    )


def _rounded(value: float | np.float64) -> float:
    return float(f"{value:.{_DIGITS}g}")
