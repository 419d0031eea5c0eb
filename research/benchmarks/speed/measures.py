"""What the benchmarks measure: ratios to yardsticks, or numbers, each with a target."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Any, Final

from in_turn import OURS, YARDSTICK

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

TIMES_AS_FAST: Final = "times as fast"
TIMES_THE_TIME: Final = "times the time"


@dataclass(frozen=True, slots=True)
class Measure:
    """Describe what a group of benchmarks measures."""

    name: str
    target: float  # the value to reach: the least where `unit` is "times as fast", else the most
    unit: str  # of the value; the two ratios are of a call of ours and of the yardstick
    yardstick: str  # what is measured for comparison
    parts: int = 1  # how many times a call of ours does the work of one of the yardstick


MEASURES: Final = (
    Measure("extraction", 12, TIMES_AS_FAST, "fingerprint-recognition 2.1.0, same image"),
    Measure(
        "extraction of four times the foreground",
        1.25,
        TIMES_THE_TIME,
        "the same foreground in four images",
        parts=4,
    ),
    Measure("extraction, peak memory", 150, "MB", "numpy and cv2 imported"),
    Measure(
        "comparison of sample prints",
        10,
        TIMES_AS_FAST,
        "NIST bozorth3 of nbis-py 0.1.3, same prints",
    ),
    Measure("comparison, 1:1", 0.5, TIMES_THE_TIME, "scipy.spatial.Delaunay, 40 points"),
    Measure("comparison, 1:N", 0.25, TIMES_THE_TIME, "scipy.spatial.Delaunay, 40 points"),
    Measure("scoring of bit descriptors", 0.1, TIMES_THE_TIME, "every print compared in full"),
    Measure("preparation", 3, TIMES_THE_TIME, "scipy.spatial.Delaunay, 40 points"),
    Measure("verification, no with reasons", 3, TIMES_THE_TIME, "yes, with the scale"),
    Measure("cold start of verify", 3, TIMES_THE_TIME, 'python -c "import numpy, cv2"'),
    Measure("cold start of help", 1.5, TIMES_THE_TIME, 'python -c "import click"'),
    Measure("heavy modules after import", 0, "modules", "scipy, cv2 and skimage"),
)


def measured(benchmarks: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the entries of pytest-benchmark as rows that ``scripts/bench --json`` writes."""
    found = []
    for measure in MEASURES:
        group = [b for b in benchmarks if b["group"] == measure.name]
        if not group:
            continue
        ours, yardstick, value = _measure(measure, group)
        at_least = measure.unit == TIMES_AS_FAST
        found.append(
            {
                "name": measure.name,
                "value": value,
                "unit": measure.unit,
                "yardstick": f"{measure.yardstick}: {yardstick}",
                "target": f"{'>=' if at_least else '<='} {measure.target:g}",
                "ok": value >= measure.target if at_least else value <= measure.target,
                "ours": ours,
            }
        )
    return found


def _measure(measure: Measure, group: Sequence[Mapping[str, Any]]) -> tuple[str, str, float]:
    """Return the times of ours and of the yardstick, in words, and the value."""
    if measure.unit not in {TIMES_AS_FAST, TIMES_THE_TIME}:
        (only,) = group
        value, beside = (float(only["extra_info"][key]) for key in ("value", "yardstick"))
        return f"{value:.4g} {measure.unit}", f"{beside:.4g} {measure.unit}", round(value, 3)
    ours, yardstick = (
        median(
            seconds / benchmark["extra_info"].get("calls", 1)
            for benchmark in group
            if benchmark["params"]["side"] == side
            for seconds in benchmark["stats"]["data"]
        )
        for side in (OURS, YARDSTICK)
    )
    ratio = ours / (measure.parts * yardstick)
    value = 1 / ratio if measure.unit == TIMES_AS_FAST else ratio
    return in_words(ours), in_words(yardstick), round(value, 3)


def in_words(seconds: float) -> str:
    """Return a time with a unit that suits it."""
    for factor, unit in ((1e6, "µs"), (1e3, "ms")):
        if seconds * factor < 999.5:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds:.3g} s"
