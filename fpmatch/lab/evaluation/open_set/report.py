"""The result of a test of open-set identification, as text and JSON."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from fpmatch.lab.evaluation.open_set.rates import near
from fpmatch.lab.evaluation.rates.error_rates import POOLED
from fpmatch.lab.evaluation.report.rate_text import bounds_note, interval_table, percent
from fpmatch.printable import count, text_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fpmatch.lab.evaluation.open_set.rates import IdentificationPoint, OpenSetRates
    from fpmatch.lab.evaluation.open_set.searches import Searches
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


class Presented(NamedTuple):
    """Impressions of a database, by their numbers, that are searched for or enrolled together."""

    database: int
    impressions: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class IdentificationReport:
    """The error rates of identification by one matcher, by databases and pooled.

    A subject is `fingers` fingers. `enrolled` are the fewest and most subjects in the gallery,
    `background` of them without prints in the databases. `presented` are the presentations that
    `searches` number.
    """

    matcher: str
    fingers: int
    background: int
    enrolled: tuple[int, int]
    bootstrap: int
    seed: int
    sets: tuple[IdentificationRow, ...]
    pooled: OpenSetRates
    searches: Searches = field(compare=False, repr=False)
    presented: tuple[Presented, ...]

    @property
    def caption(self) -> str:
        """What is searched for, and in which gallery."""
        low, high = self.enrolled
        enrolled = count(high, "subject") if low == high else f"{low} to {high} subjects"
        of = f", {self.background} of them background" if self.background else ""
        return f"{count(self.fingers, 'finger')} a subject, {enrolled} in the gallery{of}"

    @property
    def titles(self) -> list[str]:
        """The ranks and FPIRs of `cells`."""
        fpirs = (f"FPIR {100 * point.fpir:.6g} %" for point in self.pooled.points)
        return [*(f"rank {rank}" for rank in self._ranks), *fpirs]

    @property
    def _ranks(self) -> list[int]:
        return [rank for rank in RANKS_SHOWN if rank == 1 or rank < self.enrolled[1]]

    def cells(
        self, rates: OpenSetRates
    ) -> list[tuple[float | None, Interval | None, ExactBound | None]]:
        """Return FNIR, interval and its basis at each rank and FPIR of `titles`."""
        each = list(zip(rates.fnir_at_rank, rates.rank_intervals, rates.rank_bounds, strict=True))
        at_ranks = [each[rank - 1] if each else (None, None, None) for rank in self._ranks]
        return [*at_ranks, *((p.fnir, p.interval, p.bound) for p in rates.points)]

    def bounds_note(self) -> str:
        """Return what `rate_text.bounds_note` does, of all rates."""
        return bounds_note(bound for _, one in self.rows() for _, _, bound in self.cells(one))

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
            "bootstrap": self.bootstrap,
            "seed": self.seed,
            "sets": [row.as_json() for row in self.sets],
            "pooled": self.pooled.as_json(),
        }

    def as_text(self) -> str:
        """Return tables: FNIR by rank and by FPIR, intervals, and what the searches state."""
        lines, rows = [self.caption], list(self.rows())
        table = [("FNIR at", "mated", "non-mated", *self.titles)]
        table += [
            (name, str(one.mated), str(one.nonmated), *(percent(c) for c, *_ in self.cells(one)))
            for name, one in rows
        ]
        lines.append(text_table(table))
        if self.bootstrap:
            cells = [
                (name, [(of, bound) for _, of, bound in self.cells(one)]) for name, one in rows
            ]
            intervals = interval_table(self.titles, cells, "subjects")
            lines.append("\n".join(filter(None, [intervals, self.bounds_note()])))
        lines.append(text_table(stated_table(rows[-1][0], self.pooled.points)))
        return "\n".join(["\n\n".join(lines), RATIOS])


RATIOS: Final = "ratios: measured / stated, within a factor of two or beyond"


def stated_table(name: str, points: Sequence[IdentificationPoint]) -> list[tuple[str, ...]]:
    """Return a head, and what is measured and stated by the searches at each point, as cells."""
    head = (name, "by chance", "FPIR ratio", "false positives")
    table: list[tuple[str, ...]] = [(*head, "FNIR", "FNIR as stated", "FNIR ratio")]
    for point in points:
        table.append(
            (
                f"FPIR {100 * point.fpir:.6g} %",
                "-" if point.by_chance is None else f"{point.by_chance:.2g}",
                _ratio(point.fpir_ratio),
                "-" if (n := point.false_positives) is None else f"of {count(n, 'probe')}",
                percent(point.fnir),
                percent(point.stated_fnir),
                _ratio(point.fnir_ratio),
            )
        )
    return table


def _ratio(ratio: float | None) -> str:
    return "-" if ratio is None else f"{ratio:.2g}, {'within' if near(ratio) else 'beyond'} 2"
