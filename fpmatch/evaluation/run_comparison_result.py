"""What a comparison of two runs over the same prints found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from fpmatch.evaluation.intervals import Interval

LEAST_P: Final = 0.0001
"""Of a chance under this nothing is said but that it is."""


@dataclass(frozen=True, slots=True)
class RateDifference:
    """Hold a rate before and now.

    Parameters
    ----------
    rate : str
        Name of the rate, as in `Rates`.
    before, now : float
        The rate of either run, over the pairs that both compared.
    interval : Interval or None
        The 95 % interval of ``now - before``; None where there are too few fingers.
    """

    rate: str
    before: float
    now: float
    interval: Interval | None

    @property
    def verdict(self) -> str:
        """What the interval says of the difference, in words."""
        if self.now == self.before and self.interval == Interval(0.0, 0.0):
            return "no change"
        if self.interval is None:
            return "too few fingers to tell"
        if not self.interval.excludes_zero:
            return "within chance"
        return "better" if self.now < self.before else "worse"


@dataclass(frozen=True, slots=True)
class ChangedPair:
    """Name a genuine pair that one run accepts and the other does not: database and two images."""

    set_name: str
    probe: str
    reference: str


@dataclass(frozen=True, slots=True)
class DecisionChange:
    """Hold how decisions on genuine pairs changed, all databases under one threshold.

    Parameters
    ----------
    fmr : float
        The false match rate at which either run has its threshold.
    genuine : int
        Genuine pairs compared.
    gained, lost : tuple of ChangedPair
        Those that are accepted now and were not, and the other way round.
    p_value : float
        McNemar's exact test: how likely a split as uneven is where neither run is better.
    """

    fmr: float
    genuine: int
    gained: tuple[ChangedPair, ...]
    lost: tuple[ChangedPair, ...]
    p_value: float

    def in_words(self) -> str:
        """Return one sentence that tells how many decisions changed, and by what chance."""
        told = (
            f"at a false match rate of {100 * self.fmr:g} %, of {self.genuine:,} genuine pairs "
            f"{len(self.gained):,} match now and did not, {len(self.lost):,} did and do not"
        )
        if not self.gained and not self.lost:
            return told
        p = f"= {self.p_value:.2g}" if self.p_value >= LEAST_P else f"< {LEAST_P:g}"
        return f"{told} (McNemar's exact test: p {p})"


@dataclass(frozen=True, slots=True)
class PairedSet:
    """Hold the comparison of two runs over one database, or over all: pairs, and rates by name."""

    name: str
    pairs: int
    changes: tuple[RateDifference, ...]


@dataclass(frozen=True, slots=True)
class PairedComparison:
    """Hold the comparison of two runs.

    Parameters
    ----------
    before, now : str
        The two matchers.
    only_before, only_now : int
        Pairs that just one of them compared; they are left out.
    alike : int
        Pairs whose similarity is the same in both, to the last bit.
    sets : tuple of PairedSet
        A database each.
    mean, pooled : PairedSet
        The mean over the databases, and all their scores together.
    decisions : DecisionChange or None
        None where there are too few pairs for a threshold.
    """

    before: str
    now: str
    only_before: int
    only_now: int
    alike: int
    sets: tuple[PairedSet, ...]
    mean: PairedSet
    pooled: PairedSet
    decisions: DecisionChange | None

    def titles(self) -> tuple[str, str]:
        """Return what the two runs are called in a table: their matchers, where these differ."""
        if self.before in {"", self.now}:
            return "before", "now"
        return self.before, self.now

    def as_json(self) -> dict[str, Any]:
        """Return the comparison as JSON values; rates as fractions."""
        d = self.decisions
        return {
            "before": self.before,
            "now": self.now,
            "only_before": self.only_before,
            "only_now": self.only_now,
            "alike": self.alike,
            "sets": [_set_as_json(one) for one in self.sets],
            "mean": _set_as_json(self.mean),
            "pooled": _set_as_json(self.pooled),
            "decisions": d
            and {
                "fmr": d.fmr,
                "genuine": d.genuine,
                "gained": [_pair_as_json(pair) for pair in d.gained],
                "lost": [_pair_as_json(pair) for pair in d.lost],
                "mcnemar_p": d.p_value,
            },
        }


def _set_as_json(one: PairedSet) -> dict[str, Any]:
    changes = {
        change.rate: {
            "before": change.before,
            "now": change.now,
            "change_interval": change.interval and [change.interval.low, change.interval.high],
            "verdict": change.verdict,
        }
        for change in one.changes
    }
    return {"name": one.name, "pairs": one.pairs, **changes}


def _pair_as_json(pair: ChangedPair) -> dict[str, str]:
    return {"set": pair.set_name, "probe": pair.probe, "reference": pair.reference}
