"""The minutiae and transforms of an evaluation, measured against the ground truth; as tables."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.lab.evaluation.ground_truth.minutiae_counts import (
    MAIN_TOLERANCE,
    TOLERANCES,
    Cause,
    MinutiaeCounts,
    count_minutiae,
    false_minutiae,
)
from fpmatch.lab.evaluation.ground_truth.transform_error import (
    TransformError,
    TransformSummary,
    measure_transforms,
    summarise_transforms,
)
from fpmatch.printable import text_table
from fpmatch.templates.minutiae import STANDARD_DPI, Template

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.lab.evaluation.ground_truth.minutiae_counts import Tolerance
    from fpmatch.lab.evaluation.ground_truth.truth import ImpressionTruth
    from fpmatch.lab.evaluation.report.results import EvaluationReport, SetResult

    Cells = tuple[str, ...]


_DIGITS: Final = 4  # of shares, degrees and pixels in JSON
_SHARES: Final = ("precision", "recall", "F1")
_MINUTIAE_HEAD: Final = (
    *("minutiae", "within", "extracted", "visible", "TP", *_SHARES),
    *("with kind: precision", *_SHARES[1:]),
)
_FALSE_HEAD: Final = (f"false positives within {MAIN_TOLERANCE}", "all", *(c.value for c in Cause))
_TRANSFORM_HEAD: Final = (
    *("transforms", "genuine", "judged", "MATCH", "in place"),
    *("rotation", "95 %", "shift", "95 %", "scale", "95 %", "residual", "at best"),
)


@dataclass(frozen=True, slots=True)
class MinutiaeResult:
    """The extraction results of one or more prints; results add up.

    Counts are one for each of `TOLERANCES`; with any kinds, and with equal ones. `causes` counts
    the false positives at `MAIN_TOLERANCE`, with any kinds.
    """

    counts: tuple[MinutiaeCounts, ...] = (MinutiaeCounts(),) * len(TOLERANCES)
    with_kind: tuple[MinutiaeCounts, ...] = (MinutiaeCounts(),) * len(TOLERANCES)
    causes: Counter[Cause] = field(default_factory=Counter)

    def __add__(self, other: MinutiaeResult) -> MinutiaeResult:
        return MinutiaeResult(
            tuple(a + b for a, b in zip(self.counts, other.counts, strict=True)),
            tuple(a + b for a, b in zip(self.with_kind, other.with_kind, strict=True)),
            self.causes + other.causes,
        )

    @property
    def main(self) -> MinutiaeCounts:
        """The counts at `MAIN_TOLERANCE`, with any kinds."""
        return self.counts[TOLERANCES.index(MAIN_TOLERANCE)]

    @property
    def by_tolerance(self) -> list[tuple[Tolerance, MinutiaeCounts, MinutiaeCounts]]:
        """Each tolerance with its counts, with any kinds and with equal ones."""
        return list(zip(TOLERANCES, self.counts, self.with_kind, strict=True))

    def as_json(self) -> dict[str, Any]:
        """Return the result as JSON values: shares as fractions, null where undefined."""
        return {
            "extracted": self.main.extracted,
            "true": self.main.true,
            "agreement": [
                {
                    "distance_px": tolerance.distance_px,
                    "turn_deg": round(math.degrees(tolerance.turn), _DIGITS),
                    **_counts_as_json(counts),
                    "with_kind": _counts_as_json(with_kind),
                }
                for tolerance, counts, with_kind in self.by_tolerance
            ],
            "false_positives_by_cause": _causes_as_json(self.causes),
        }


@dataclass(frozen=True, slots=True)
class MinutiaeSetResult:
    """The results on one database, or on several pooled.

    `prints` holds each image's name and result, `genuine` the number of genuine pairs, and `errors`
    those of the pairs that were judged.
    """

    name: str
    prints: tuple[tuple[str, MinutiaeResult], ...]
    genuine: int
    errors: tuple[TransformError, ...]

    @property
    def total(self) -> MinutiaeResult:
        """The results of all prints together."""
        return sum((result for _, result in self.prints), MinutiaeResult())

    @property
    def transforms(self) -> TransformSummary:
        """A summary of the errors of the judged pairs."""
        return summarise_transforms(self.errors)

    def as_json(self) -> dict[str, Any]:
        """Return the row as JSON values, without the single prints."""
        return {
            "name": self.name,
            "prints": len(self.prints),
            **self.total.as_json(),
            "transforms": {
                "genuine": self.genuine,
                **{key: _rounded(value) for key, value in asdict(self.transforms).items()},
            },
        }


@dataclass(frozen=True, slots=True)
class MinutiaeReport:
    """The results on some databases with ground truth."""

    sets: tuple[MinutiaeSetResult, ...]

    @property
    def pooled(self) -> MinutiaeSetResult:
        """All databases as if they were one."""
        return MinutiaeSetResult(
            name="pooled",
            prints=tuple(p for row in self.sets for p in row.prints),
            genuine=sum(row.genuine for row in self.sets),
            errors=tuple(e for row in self.sets for e in row.errors),
        )

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON values; each database with its prints, one by one."""
        return {
            "sets": [
                {**row.as_json(), "by_print": [_print_as_json(*p) for p in row.prints]}
                for row in self.sets
            ],
            "pooled": self.pooled.as_json(),
        }


def measure_minutiae(
    report: EvaluationReport, truths: Sequence[Sequence[ImpressionTruth]]
) -> MinutiaeReport:
    """Measure the templates and the transforms of an evaluation against the truth.

    `truths` holds the truth about each database's impressions, as `load_truth` returns it.
    """
    rows = zip(report.sets, truths, strict=True)
    return MinutiaeReport(tuple(_measure_set(row, truth, report.matcher) for row, truth in rows))


def _measure_set(
    row: SetResult, truths: Sequence[ImpressionTruth], matcher: str
) -> MinutiaeSetResult:
    names = [impression.name for impression in row.extracted.dataset.impressions]
    results = [
        measure_print(extraction.template, truth)
        for extraction, truth in zip(row.extracted.extractions, truths, strict=True)
    ]
    errors = tuple(measure_transforms(row, truths, matcher))
    return MinutiaeSetResult(row.name, tuple(zip(names, results, strict=True)), row.genuine, errors)


def measure_print(template: Template | None, truth: ImpressionTruth) -> MinutiaeResult:
    """Measure one template against the truth, in pixels of the same image.

    Without a template, all true minutiae are false negatives. Tolerances are at 500 dpi.
    """
    if template is None:
        missed = MinutiaeCounts(false_negatives=int(np.count_nonzero(truth.visible)))
        return MinutiaeResult((missed,) * len(TOLERANCES), (missed,) * len(TOLERANCES))
    factor = STANDARD_DPI / template.dpi
    extracted, true = (
        replace(m, x=m.x * factor, y=m.y * factor) for m in (template.minutiae, truth.minutiae)
    )
    counts, with_kind = (
        tuple(count_minutiae(extracted, true, truth.visible, t, with_kind=kind) for t in TOLERANCES)
        for kind in (False, True)
    )
    return MinutiaeResult(counts, with_kind, Counter(false_minutiae(template, truth).values()))


def _print_as_json(name: str, result: MinutiaeResult) -> dict[str, Any]:
    counts = _counts_as_json(result.main)
    return {"name": name, **counts, "false_positives_by_cause": _causes_as_json(result.causes)}


def _causes_as_json(causes: Counter[Cause]) -> dict[str, int]:
    return {cause.name.lower(): causes[cause] for cause in Cause}


def _counts_as_json(counts: MinutiaeCounts) -> dict[str, Any]:
    shares = {key: _rounded(getattr(counts, key)) for key in ("precision", "recall", "f1")}
    return {**asdict(counts), **shares}


def _rounded(value: float) -> float | None:
    if isinstance(value, int):
        return value
    return round(value, _DIGITS) if math.isfinite(value) else None


def format_minutiae(report: MinutiaeReport) -> str:
    """Return three tables: of the minutiae, of the false positives by cause, of the transforms.

    Several databases are followed by a row that pools them; undefined cells are "-".
    """
    rows = [*report.sets, *([report.pooled] if len(report.sets) > 1 else [])]
    blocks = [
        [_MINUTIAE_HEAD, *(cells for row in rows for cells in _minutiae_cells(row))],
        [_FALSE_HEAD, *map(_false_cells, rows)],
        [_TRANSFORM_HEAD, *map(_transform_cells, rows)],
    ]
    return "\n\n".join(map(text_table, blocks))


def _minutiae_cells(row: MinutiaeSetResult) -> list[Cells]:
    main = row.total.main
    return [
        (
            *(row.name, str(tolerance), str(main.extracted), str(main.true)),
            *(str(counts.true_positives), *_shares(counts), *_shares(with_kind)),
        )
        for tolerance, counts, with_kind in row.total.by_tolerance
    ]


def _shares(counts: MinutiaeCounts) -> Cells:
    return tuple(_percent(share) for share in (counts.precision, counts.recall, counts.f1))


def _false_cells(row: MinutiaeSetResult) -> Cells:
    causes = row.total.causes
    return (row.name, str(causes.total()), *(str(causes[cause]) for cause in Cause))


def _transform_cells(row: MinutiaeSetResult) -> Cells:
    t = row.transforms
    return (
        *(row.name, str(row.genuine), str(t.judged), _percent(t.match), _percent(t.in_place)),
        *(_number(v, "°") for v in (t.rotation_deg, t.rotation_deg_p95)),
        *(_number(v, " px") for v in (t.shift_px, t.shift_px_p95)),
        *(_number(v, " %") for v in (t.scale_percent, t.scale_percent_p95)),
        *(_number(v, " px") for v in (t.residual_px, t.least_residual_px)),
    )


def _percent(share: float) -> str:
    return "-" if math.isnan(share) else f"{100 * share:.1f} %"


def _number(value: float, unit: str) -> str:
    return "-" if math.isnan(value) else f"{value:.2f}{unit}"
