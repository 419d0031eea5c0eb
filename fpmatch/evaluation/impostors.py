"""The comparisons of different fingers that a calibration is fitted to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.errors import DatasetError
from fpmatch.evaluation.all_pairs import compare_all_pairs
from fpmatch.evaluation.bootstrap import Trials
from fpmatch.evaluation.comparison import NO_TEMPLATE
from fpmatch.evaluation.extraction import extract_image
from fpmatch.evaluation.intervals import trials_of
from fpmatch.evaluation.run import evaluate
from fpmatch.evaluation.scores_reader import choose_matcher, read_scores
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.extraction import ExtractedSet, Extractor
    from fpmatch.evaluation.report import EvaluationReport
    from fpmatch.matching.result import Matcher


@dataclass(frozen=True, slots=True, eq=False)
class ImpostorSet:
    """Hold one database's comparisons of different fingers.

    Parameters
    ----------
    name : str
        The database.
    trials : Trials
        The comparisons, none of them genuine, none of a print without template.
    """

    name: str
    trials: Trials


def gather_impostors(
    sources: Sequence[str | os.PathLike[str]],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    workers: int | None = None,
    progress: Progress = no_progress,
    extractor: Extractor = extract_image,
) -> list[ImpostorSet]:
    """Return the impostor comparisons of files of scores and of folders of prints.

    Parameters
    ----------
    sources : sequence of path
        CSV files that `fpmatch evaluate --scores` wrote, and FVC-style folders; the latter are
        extracted and compared by the extended protocol.
    matcher : str or Matcher
        The matcher whose scores to take, and to compare with.
    workers, progress, extractor
        As for `evaluate`.

    Returns
    -------
    list of ImpostorSet
        One a database: of the files, then of the folders.

    Raises
    ------
    DatasetError
        If a source cannot be used, or a database comes twice.
    MatcherError
        If the matcher is unknown.
    """
    paths = [Path(source) for source in sources]
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    gathered = [
        _impostors_of(one.name, one.trials, one.compared)
        for path in paths
        if path.is_file()
        for one in choose_matcher(read_scores(path), chosen.name, path)
    ]
    seen: set[str] = set()
    for one in gathered:
        if one.name in seen:
            raise DatasetError(f"{one.name}: scores of this database are given twice")
        seen.add(one.name)
    folders = [path for path in paths if not path.is_file()]
    if folders:
        report = evaluate(
            folders, matcher=chosen, workers=workers, progress=progress, extractor=extractor
        )
        for row in report.sets:
            if row.name in seen:
                raise DatasetError(f"{row.name}: given both as a folder and as scores")
        gathered += impostors_of_report(report)
    return gathered


def impostors_of_report(report: EvaluationReport) -> list[ImpostorSet]:
    """Return the impostor comparisons of an evaluation, a database each.

    Pairs with an image that gave no template are left out: their similarity of 0 would make the
    matcher look more certain than it is.

    Parameters
    ----------
    report : EvaluationReport
        The evaluation.

    Returns
    -------
    list of ImpostorSet
        Its databases.
    """
    return [
        _impostors_of(row.name, trials_of(row), row.outcomes["reason"] != NO_TEMPLATE)
        for row in report.sets
    ]


def impostors_among(
    sets: Sequence[ExtractedSet], name: str, workers: int | None = None
) -> ImpostorSet:
    """Return the impostor comparisons among all impressions of all databases.

    Fingers of different databases are taken for different ones, so that a few databases make very
    many comparisons. The default matcher compares.

    Parameters
    ----------
    sets : sequence of ExtractedSet
        The databases.
    name : str
        What to call them together.
    workers : int, optional
        Threads to use (default: one a core).

    Returns
    -------
    ImpostorSet
        One for all.
    """
    templates, shown = [], []
    for number, one in enumerate(sets):
        for impression, found in zip(one.dataset.impressions, one.extractions, strict=True):
            if found.template is not None:
                templates.append(found.template)
                shown.append((number, impression.finger))
    # of no impressions at all the list has no rows
    fingers, finger = np.unique(np.array(shown, int).reshape(-1, 2), axis=0, return_inverse=True)
    finger = finger.ravel()
    similarity = compare_all_pairs(templates, workers=workers)
    probe, reference = (finger[side] for side in np.triu_indices(len(templates), 1))
    trials = Trials(similarity, probe, reference, len(fingers))
    return _impostors_of(name, trials, np.ones(len(similarity), bool))


def _impostors_of(name: str, trials: Trials, compared: NDArray[np.bool_]) -> ImpostorSet:
    kept = ~trials.genuine & compared
    chosen = replace(
        trials,
        similarity=trials.similarity[kept],
        probe=trials.probe[kept],
        reference=trials.reference[kept],
    )
    return ImpostorSet(name, chosen)
