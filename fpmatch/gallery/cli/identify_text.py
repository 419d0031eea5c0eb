"""What `fpmatch identify` shows: candidates for one probe and for several, and runs into a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.printable import count, printable
from fpmatch.prints.report import odds, transform_in_words

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fpmatch.gallery.batch.candidates import SearchSummary
    from fpmatch.gallery.listing.entry import Entry
    from fpmatch.gallery.search.identification import (
        Candidate,
        FusedIdentification,
        Identification,
        SubjectCandidate,
    )

_RATES: Final = f"  rank  score  {'FMR':<18}  by chance  "
_COLUMNS: Final = f"{_RATES}{'print':<12}  number  picture"
_SUBJECT_COLUMNS: Final = f"{_RATES}{'subject':<12}  fingers"


def summary_as_text(done: SearchSummary) -> str:
    """Return what is shown of a run into a file."""
    from fpmatch.gallery.batch.candidates import is_json_lines

    counts = [count(done.probes, "probe")]
    counts += [f"{done.resumed} of them before"] if done.resumed else []
    counts += [f"{done.failed} without a template"] if done.failed else []
    rate = f" ({done.rate:.1f} a second)" if done.rate else ""
    head = f"{', '.join(counts)}: {done.seconds:.1f} s{rate}"
    what = "line" if is_json_lines(done.output) else "row"
    return f"{head}\n{printable(done.output)}: {count(done.rows, what)}"


def candidates_as_text(
    probe: str, result: Identification, entries: Sequence[Entry], seconds: float
) -> str:
    """Return the candidates for one probe."""
    lines = []
    for candidate, entry in zip(result.candidates, entries, strict=True):
        lines.append(
            f"{_rates(result, candidate)}{printable(entry.label):<12}  {entry.id:>6}  "
            f"{printable(entry.source)}"
        )
        lines += [f"        {line}" for line in _transform_lines(candidate)]
    return _as_text([probe], result, seconds, _COLUMNS, lines)


def subjects_as_text(
    probes: Sequence[str], result: FusedIdentification, entries: Mapping[int, Entry], seconds: float
) -> str:
    """Return the candidates for several probes."""
    lines = []
    for one in result.candidates:
        fingers = (f"{printable(entries[f.number].label)} {f.score:.1f}" for f in one.fingers)
        lines.append(f"{_rates(result, one)}{printable(one.subject):<12}  {', '.join(fingers)}")
    return _as_text(probes, result, seconds, _SUBJECT_COLUMNS, lines)


def _as_text(
    probes: Sequence[str],
    result: Identification | FusedIdentification,
    seconds: float,
    columns: str,
    lines: Sequence[str],
) -> str:
    """Return lines of candidates under a line on the search."""
    of_all = f" of {result.enrolled}" if result.preselected else ""
    compared = f"{result.compared}{of_all} {'print' if result.enrolled == 1 else 'prints'} compared"
    stages = ""
    if result.effort is not None:
        passed = zip(result.passed_on, ("index", "descriptors"), strict=True)
        numbers = ", ".join(f"{prints:,} by {stage}" for prints, stage in passed)
        stages = f" (effort {result.effort}: {numbers})"
    head = f"{' with '.join(map(printable, probes))}: {compared} in {seconds:.2f} s{stages}"
    if not lines:
        return f"{head}, no candidate"
    if any(map(result.is_extrapolated, result.candidates)):
        measured = odds(result.smallest_measured_fmr)
        lines = [*lines, f"  * extrapolated: measured up to {measured}"]
    return "\n".join([head, columns, *lines])


def _rates(
    result: Identification | FusedIdentification, candidate: Candidate | SubjectCandidate
) -> str:
    """Return how a line on a candidate begins."""
    rate = f"{odds(candidate.fmr)}{' *' if result.is_extrapolated(candidate) else ''}"
    return (
        f"  {candidate.rank:>4}  {candidate.score:>5.1f}  {rate:<18}  "
        f"{candidate.expected_false:>9.2g}  "
    )


def _transform_lines(candidate: Candidate) -> list[str]:
    """Return the line on the transform of a candidate, if it is to be shown."""
    comparison = candidate.comparison
    if comparison is None:
        return []
    if comparison.transform is None:
        return [f"no transform: {comparison.reason}"]
    pairs = count(len(comparison.pairs), "pair")
    return [f"{transform_in_words(comparison.transform)}; {pairs}, {comparison.rms_px:.1f} px rms"]
