"""Comparisons as a report: the rates of each database, their mean, and all scores pooled.

They are those of an evaluation of prints, or scores that are already there: of fpmatch, or of any
other matcher.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import astuple, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.gallery.batch.comparer import NO_TEMPLATE
from fpmatch.gallery.listing.entry import NamePattern
from fpmatch.gallery.store.stored_template import minutiae_digest
from fpmatch.lab.evaluation.databases.protocol import finger_numbers
from fpmatch.lab.evaluation.rates.error_rates import Rates, error_rates
from fpmatch.lab.evaluation.rates.scores import (
    finger_of_fvc_name,
    read_genuine_and_impostor,
    read_scores,
)
from fpmatch.lab.evaluation.rates.scores_set import ScoresSet, Trials, identify_all
from fpmatch.lab.evaluation.report.results import (
    EvaluationReport,
    RatesReport,
    SetRates,
    SetResult,
    split_scores,
)

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.lab.evaluation.databases.protocol import Pairs

    AnyPath = str | os.PathLike[str]

UNKNOWN_FINGERS: Final = (
    "its fingers are not known: comparisons are drawn for the 95 % intervals, which are too narrow "
    "where fingers come in several comparisons"
)
PROBABLY_DISTANCES: Final = (
    "genuine scores are mostly lower than impostor scores: distances need --distances"
)
_HALF: Final = 0.5


def summarise_set(
    matcher: str, extracted: ExtractedSet, pairs: Pairs, outcomes: NDArray[np.void]
) -> SetResult:
    """Summarise the comparisons of one database."""
    cpu_us = outcomes["cpu_us"][np.isfinite(outcomes["cpu_us"])]
    scores = _scores_of_set(matcher, extracted, pairs, outcomes)
    return SetResult(
        scores=scores,
        rates=error_rates(*scores.split()),
        identification=identify_all(scores),
        failures=tuple(extracted.failures),
        extract_ms=extracted.median_cpu_ms,
        match_us=float(np.median(cpu_us)) if cpu_us.size else math.nan,
        extracted=extracted,
        pairs=pairs,
        outcomes=outcomes,
        identical=_find_identical(extracted, pairs),
    )


def _scores_of_set(
    matcher: str, extracted: ExtractedSet, pairs: Pairs, outcomes: NDArray[np.void]
) -> ScoresSet:
    """Return the comparisons of a database; its fingers are numbered from 0."""
    impressions = extracted.dataset.impressions
    finger = finger_numbers(impressions)
    fingers = int(finger.max()) + 1
    trials = Trials(outcomes["similarity"], finger[pairs.probe], finger[pairs.reference], fingers)
    compared = outcomes["reason"] != NO_TEMPLATE
    graded = [e.quality for e in extracted.extractions]
    quality = None
    if any(value is not None for value in graded):
        quality = np.array([np.nan if value is None else value for value in graded])
    return ScoresSet(
        matcher=matcher,
        name=extracted.dataset.name,
        prints=tuple(i.name for i in impressions),
        probe=pairs.probe,
        reference=pairs.reference,
        trials=trials,
        compared=compared,
        quality=quality,
        overlap=np.where(compared, outcomes["overlap"], np.nan),
    )


def _find_identical(extracted: ExtractedSet, pairs: Pairs) -> tuple[int, ...]:
    """Return the pairs whose prints have the same frame and minutiae."""
    templates = [one.template for one in extracted.extractions]
    digests = [b"" if template is None else minutiae_digest(template) for template in templates]
    first: dict[bytes, int] = {}
    number = np.array([first.setdefault(d, k) if d else -1 for k, d in enumerate(digests)])
    same = (number[pairs.probe] == number[pairs.reference]) & (number[pairs.probe] >= 0)
    return tuple(np.flatnonzero(same).tolist())


def summarise(matcher: str, protocol: str, sets: Sequence[SetResult]) -> EvaluationReport:
    """Summarise the rows of all databases."""
    return EvaluationReport(matcher, protocol, tuple(sets), *_together(sets))


def summarise_scores(sets: Sequence[ScoresSet]) -> RatesReport:
    """Return the error rates of scores that one matcher gave, a row a database.

    Prints none of whose comparisons has a score count as failures to extract.
    """
    rows = tuple(
        SetRates(
            scores=scores,
            rates=error_rates(*scores.split()),
            identification=identify_all(scores),
            failures=tuple((Path(name), f"{name}: no score") for name in scores.never_compared),
            extract_ms=math.nan,
            match_us=math.nan,
        )
        for scores in sets
    )
    return RatesReport(sets[0].matcher, "", rows, *_together(rows))


def _together(sets: Sequence[SetRates]) -> tuple[Rates, Rates]:
    """Return the mean of the rates of all databases, and the rates of all their scores."""
    columns = zip(*(astuple(row.rates) for row in sets), strict=True)
    mean = Rates(*(None if None in column else float(np.mean(column)) for column in columns))
    return mean, error_rates(*split_scores(sets))


def evaluate_scores(
    files: Sequence[AnyPath] = (),
    *,
    genuine_and_impostor: Sequence[tuple[AnyPath, AnyPath]] = (),
    distances: bool = False,
    pattern: str | None = None,
) -> list[RatesReport]:
    r"""Compute the error rates of scores in files, one report a matcher.

    `files`: files of scores, see `fpmatch.lab.evaluation.rates.scores.read_scores`. Without a
    column ``matcher``, or where files have scores of the same matcher and database, the matcher is
    named after the file. Without a column ``set`` the database is the only one that other files
    name, if any. `genuine_and_impostor`: files of genuine, and of impostor scores of a matcher,
    which is named after the first. `distances`: as for
    `fpmatch.lab.evaluation.rates.scores.read_scores`. `pattern`: finds the fingers in names of
    prints, as for `fpmatch.gallery.listing.entry.NamePattern`; by default prints are named FFF_M.
    Raises a `DatasetError` if there is no file, one cannot be read, or a matcher comes twice; a
    `GalleryError` if the pattern is none.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.report.score_reports import evaluate_scores
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "mine.txt")
    ...     _ = file.write_text("1_1 1_2 0.9\n1_1 2_1 0.2\n1_2 2_1 0.1\n")
    ...     (report,) = evaluate_scores([file])
    >>> report.matcher, report.genuine, report.impostor, report.pooled.eer
    ('mine', 1, 2, 0.0)
    """
    finger_of = finger_in_name(pattern)
    given: list[tuple[Path, ScoresSet]] = []
    for file in map(Path, files):
        sets = read_scores(file, name="", distances=distances, finger_of=finger_of)
        given += [(file, one) for one in sets]
    for genuine, impostor in genuine_and_impostor:
        of_pair = read_genuine_and_impostor(genuine, impostor, distances=distances)
        given.append((Path(genuine), replace(of_pair, name="")))
    if not given:
        raise DatasetError("no file of scores given")
    named = {one.name for _, one in given if one.name}
    name = named.pop() if len(named) == 1 else "scores"
    given = [(file, one if one.name else replace(one, name=name)) for file, one in given]
    times = Counter((one.matcher, one.name) for _, one in given)
    by_matcher: dict[str, list[ScoresSet]] = {}
    for file, one in given:
        matcher = one.matcher
        if not matcher or times[matcher, one.name] > 1:
            matcher = f"{matcher} ({file.stem})" if matcher else file.stem
        by_matcher.setdefault(matcher, []).append(replace(one, matcher=matcher))
    for matcher, sets in by_matcher.items():
        if len({one.name for one in sets}) < len(sets):
            raise DatasetError(f"two files of scores of the same name: {matcher}")
    return [summarise_scores(sets) for sets in by_matcher.values()]


def finger_in_name(pattern: str | None = None) -> Callable[[str], str | None]:
    """Return the function that finds the finger in the name of a print, by default FFF_M."""
    if pattern is None:
        return finger_of_fvc_name
    names = NamePattern(pattern)

    def finger_of(name: str) -> str | None:
        label = names.label(Path(name))
        return None if label is None else repr(label.of_finger)

    return finger_of


def notes_on(report: RatesReport) -> list[str]:
    """Return what a user should know of how the scores of a report were understood."""
    sets = [row.scores for row in report.sets]
    notes = list(dict.fromkeys(one.note for one in sets if one.note))
    failed = sum(int((~one.compared).sum()) for one in sets)
    if failed:
        total = sum(one.compared.size for one in sets)
        notes.append(f"{failed:,} of {total:,} comparisons have no score and count as the lowest")
    if not all(one.trials.fingers for one in sets):
        notes.append(UNKNOWN_FINGERS)
    if report.pooled.eer is not None and report.pooled.eer > _HALF:
        notes.append(PROBABLY_DISTANCES)
    return notes
