"""The result of a test of open-set identification, as text and JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fpmatch.lab.evaluation.rates.error_rates import POOLED
from fpmatch.lab.evaluation.report.rate_text import bounds_note, interval_table, percent
from fpmatch.printable import count, text_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fpmatch.lab.evaluation.open_set.rates import IdentificationPoint, OpenSetRates
    from fpmatch.lab.evaluation.rates.intervals import ExactBound, Interval

RANKS_SHOWN = (1, 10, 100)


@dataclass(frozen=True, slots=True)
class IdentificationRow:
    """The error rates of the searches for the prints of one database.

    `prints` is the number of its prints, of which `failures` have no template.
    """

    name: str
    subjects: int
    prints: int
    failures: int
    rates: OpenSetRates

    def as_json(self) -> dict[str, Any]:
        """Return the row as JSON values."""
        return {
            "name": self.name,
            "subjects": self.subjects,
            "prints": self.prints,
            "failures": self.failures,
            **self.rates.as_json(),
        }


@dataclass(frozen=True, slots=True)
class IdentificationReport:
    """The error rates of identification by one matcher, by databases and pooled.

    A subject is `fingers` fingers. `enrolled` are the fewest and most subjects in the gallery,
    `background` of them without prints in the databases. `preselected` is whether only prints on
    candidate lists were compared. Scores above `largest_measured_score` are extrapolated.
    """

    matcher: str
    fingers: int
    background: int
    enrolled: tuple[int, int]
    preselected: bool
    bootstrap: int
    seed: int
    largest_measured_score: float
    sets: tuple[IdentificationRow, ...]
    pooled: OpenSetRates

    def rows(self) -> Iterator[tuple[str, OpenSetRates]]:
        """Yield the name and the rates of each database, and of several all."""
        yield from ((row.name, row.rates) for row in self.sets)
        if len(self.sets) > 1:
            yield POOLED, self.pooled

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON values: rates as fractions, null where undefined."""
        return {
            "matcher": self.matcher,
            "fingers": self.fingers,
            "enrolled": list(self.enrolled),
            "background": self.background,
            "preselected": self.preselected,
            "bootstrap": self.bootstrap,
            "seed": self.seed,
            "largest_measured_score": self.largest_measured_score,
            "sets": [row.as_json() for row in self.sets],
            "pooled": self.pooled.as_json(),
        }

    def as_text(self) -> str:
        """Return tables: FNIR by rank and by FPIR, intervals, thresholds and what 1:1 predicts."""
        low, high = self.enrolled
        enrolled = count(high, "subject") if low == high else f"{low} to {high} subjects"
        of = f", {self.background} of them background" if self.background else ""
        lines = [f"{count(self.fingers, 'finger')} a subject, {enrolled} in the gallery{of}"]
        if self.preselected:
            lines[0] += "; only prints on candidate lists were compared"
        rows = list(self.rows())
        ranks = [r for r in RANKS_SHOWN if r == 1 or r < high]
        fpirs = [f"{100 * point.fpir:.6g} %" for point in self.pooled.points]
        titles = [*(f"rank {r}" for r in ranks), *(f"FPIR {fpir}" for fpir in fpirs)]
        table = [("FNIR at", "mated", "non-mated", *titles)]
        table += [
            (
                *(name, str(one.mated), str(one.nonmated)),
                *(percent(one.fnir_at_rank[r - 1] if one.mated else None) for r in ranks),
                *(percent(point.fnir) for point in one.points),
            )
            for name, one in rows
        ]
        lines.append(text_table(table))
        if self.bootstrap:
            lines.append(_intervals(rows, ranks, titles))
        lines.append(self._predictions(rows[-1][0], rows[-1][1].points))
        return "\n\n".join(lines)

    def _predictions(self, name: str, points: Sequence[IdentificationPoint]) -> str:
        table = [(name, "threshold", "1:1 predicts", "false positives", "FNIR", "1:1 predicts")]
        for point in points:
            beyond = " *" if point.extrapolated else ""
            table.append(
                (
                    f"FPIR {100 * point.fpir:.6g} %",
                    "-" if point.threshold is None else f"{point.threshold:.1f}",
                    f"{point.predicted_threshold:.1f}{beyond}",
                    "-" if (n := point.false_positives) is None else f"of {count(n, 'probe')}",
                    percent(point.fnir),
                    f"{percent(point.predicted_fnir)}{beyond}",
                )
            )
        text = text_table(table)
        if any(point.extrapolated for point in points):
            text += f"\n* extrapolated: measured up to a score of {self.largest_measured_score:.1f}"
        return text


def _intervals(
    rows: Sequence[tuple[str, OpenSetRates]], ranks: Sequence[int], titles: Sequence[str]
) -> str:
    cells: list[tuple[str, list[tuple[Interval | None, ExactBound | None]]]] = []
    for name, one in rows:
        each = list(zip(one.rank_intervals, one.rank_bounds, strict=True))  # none without mates
        at_ranks = [each[r - 1] if each else (None, None) for r in ranks]
        cells.append((name, [*at_ranks, *((p.interval, p.bound) for p in one.points)]))
    note = bounds_note(bound for _, row in cells for _, bound in row)
    return "\n".join(filter(None, [interval_table(titles, cells, "subjects"), note]))
