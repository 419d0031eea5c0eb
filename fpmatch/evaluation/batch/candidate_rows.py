"""The forms of a file of candidates: CSV, a row a candidate, or JSON lines, a document a probe.

A CSV file has the columns `COLUMNS`: a row for each candidate of a probe, best first, and one row
without a candidate, but with the reason, for a probe that has none or has no template. Each line of
a file of JSON lines is what ``fpmatch identify --json`` prints for one probe, but for the time and
the damaged entries, and with the same reason.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from fpmatch.errors import OutputError
from fpmatch.evaluation.batch.score_file import csv_lines
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.identify import Identification

OF_CANDIDATES: Final = (
    *("rank", "id", "subject", "finger", "impression", "source", "score", "fmr", "extrapolated"),
    *("expected_false_matches", "impressions", "impression_score"),
)
OF_SEARCHES: Final = ("enrolled", "compared", "fingers", "loss", "passed_on")
COLUMNS: Final = ("probe", *OF_CANDIDATES, *OF_SEARCHES, "reason")
NO_CANDIDATE: Final = "no candidate"
JSON_LINES: Final = ".jsonl"
FORMATS: Final = (".csv", JSON_LINES)


class ProbeRows(NamedTuple):
    """What a file has of a probe: the path, and the outcome, or why there is no template."""

    path: str
    result: Identification | None
    entries: Sequence[Entry]
    reason: str


class CandidateFile(Protocol):
    """The form of a file of candidates."""

    @property
    def header(self) -> bytes:
        """How the file begins."""

    def lines(self, probe: ProbeRows) -> list[bytes]:
        """Return the lines of a probe."""


def check_candidates_format(output: Path) -> None:
    """Raise an OutputError unless a file of candidates can have this name."""
    if output.suffix.lower() not in FORMATS:
        raise OutputError(f"{output}: candidates are written as {' or '.join(FORMATS)}")


def candidate_file(output: Path, **about: str) -> CandidateFile:
    """Return the form of a file by its name; `about` are members of all documents of JSON lines."""
    check_candidates_format(output)
    return CandidateJson(about) if is_json_lines(output) else CandidateCsv()


def is_json_lines(output: Path) -> bool:
    """Return whether the name of a file is that of JSON lines."""
    return output.suffix.lower() == JSON_LINES


class CandidateCsv:
    """Candidates as rows of CSV."""

    header: Final = csv_lines([COLUMNS])

    def lines(self, probe: ProbeRows) -> list[bytes]:
        """Return the rows of a probe."""
        return [csv_lines([row]) for row in _rows(probe)]


def _rows(probe: ProbeRows) -> Iterator[list[object]]:
    nobody, result = [""] * len(OF_CANDIDATES), probe.result
    if result is None:
        yield [probe.path, *nobody, *[""] * len(OF_SEARCHES), probe.reason]
        return
    stages = ["" if result.loss is None else result.loss, " ".join(map(str, result.passed_on))]
    about = [result.enrolled, result.compared, result.fingers, *stages]
    found = result.candidate_dicts(probe.entries)
    for candidate in found:
        candidate["extrapolated"] = int(candidate["extrapolated"])
        yield [probe.path, *(candidate[name] for name in OF_CANDIDATES), *about, ""]
    if not found:
        yield [probe.path, *nobody, *about, NO_CANDIDATE]


@dataclass(frozen=True, slots=True)
class CandidateJson:
    """Candidates as JSON lines, each with the members `about` the search."""

    about: dict[str, str]
    header: bytes = b""

    def lines(self, probe: ProbeRows) -> list[bytes]:
        """Return the document of a probe on a line; one without a template has no numbers."""
        result, reason = probe.result, probe.reason or None
        document: dict[str, Any] = dict.fromkeys(OF_SEARCHES)
        candidates: list[dict[str, Any]] = []
        if result is not None:
            document = {name: getattr(result, name) for name in OF_SEARCHES}
            candidates = result.candidate_dicts(probe.entries)
            reason = None if candidates else NO_CANDIDATE
        document = {"probe": probe.path, **self.about, **document}
        document |= {"candidates": candidates, "reason": reason}
        return [f"{json_text(document, indent=None)}\n".encode()]
