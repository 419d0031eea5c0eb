"""A report against ground truth as tables of text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from fpmatch.evaluation.ground_truth.false_minutiae import Cause
from fpmatch.evaluation.ground_truth.minutiae_counts import MAIN_TOLERANCE
from fpmatch.text_table import text_table

if TYPE_CHECKING:
    from fpmatch.evaluation.ground_truth.minutiae_counts import MinutiaeCounts
    from fpmatch.evaluation.ground_truth.report import MinutiaeReport, MinutiaeSetResult

    Cells = tuple[str, ...]

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
