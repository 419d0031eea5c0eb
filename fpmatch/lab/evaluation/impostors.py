"""The impostor comparisons that a calibration is fitted to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fpmatch.base.parameters import parameters_of
from fpmatch.errors import DatasetError
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.listing.kinds import kind_of
from fpmatch.lab.evaluation.databases.extraction import dataset_reader, extract_image
from fpmatch.lab.evaluation.rates.scores import choose_matcher, read_scores
from fpmatch.lab.evaluation.report.results import scores_of
from fpmatch.lab.evaluation.run import evaluate, load_datasets
from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

    from fpmatch.gallery.listing.entry import NamePattern
    from fpmatch.lab.evaluation.databases.extraction import Extractor
    from fpmatch.lab.evaluation.rates.scores_set import ScoresSet, Trials
    from fpmatch.lab.evaluation.report.results import EvaluationReport
    from fpmatch.matching.result import Matcher


@dataclass(frozen=True, slots=True, eq=False)
class ImpostorSet:
    """One database's impostor comparisons, none of a print without template."""

    name: str
    trials: Trials


def gather_impostors(
    sources: Sequence[str | os.PathLike[str]],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    workers: int | None = None,
    progress: Progress = no_progress,
    extractor: Extractor | None = None,
    pattern: str | NamePattern | None = None,
    by_folder: bool = False,
    dpi: float | None = None,
    reading: Mapping[str, Any] = MappingProxyType({}),
) -> list[ImpostorSet]:
    """Return the impostor comparisons of files of scores, then of databases of prints.

    `sources`: files of scores, of which those of the matcher are read, and folders, manifests and
    galleries, whose prints are compared by the extended protocol. `matcher`, `workers`, `progress`,
    `extractor`, `pattern`, `by_folder`: as for `evaluate`; in place of the default matcher, the one
    whose similarities are not lowered by the pairs that chance makes compares and is read. `dpi`:
    the resolution of all images; `reading`: further parameters of `dataset_reader`.
    Raises a `DatasetError` if a source cannot be used, or a database comes twice; a `MatcherError`
    if the matcher is unknown.
    """
    given = get_matcher(matcher) if isinstance(matcher, str) else matcher
    chosen = _calibrated(given)
    gathered = [
        ImpostorSet(one.name, one.impostors)
        for source in sources
        if kind_of(source) == "file"
        for one in _scores_of(chosen, given.name, source)
    ]
    seen: set[str] = set()
    for one in gathered:
        if one.name in seen:
            raise DatasetError(f"{one.name}: scores of this database are given twice")
        seen.add(one.name)
    if databases := [source for source in sources if kind_of(source) != "file"]:
        named = load_datasets(databases, pattern=pattern, by_folder=by_folder)
        loaded = [dataset.at(dpi) for dataset in named]
        if extractor is None:
            extractor = partial(extract_image, reader=dataset_reader(loaded, **reading))
        how: dict[str, Any] = {"workers": workers, "progress": progress, "extractor": extractor}
        report = evaluate(loaded, matcher=chosen, **how)
        for row in report.sets:
            if row.name in seen:
                raise DatasetError(f"{row.name}: given both as a folder and as scores")
        gathered += impostors_of_report(report)
    return gathered


def _calibrated(matcher: Matcher) -> Matcher:
    """Return the matcher to whose similarities a calibration of `matcher` is fitted.

    The default matcher holds its pairs against chance, which lowers the similarities of the highest
    impostors: fitted to those, a calibration would raise the scores again.
    """
    if not isinstance(matcher, UnitCircleMatcher):
        return matcher
    own = {name: one.value for name, one in parameters_of(matcher.parameters).items()}
    return type(matcher)(**own | {"beyond_share": 0.0})


def _scores_of(chosen: Matcher, given: str, source: str | os.PathLike[str]) -> list[ScoresSet]:
    """Return the sets of scores of a matcher; say why scores of the given one are refused."""
    sets = read_scores(source)
    if {one.matcher for one in sets} == {given} != {chosen.name}:
        raise DatasetError(
            f"the highest similarities of {given} are lowered by the pairs that chance makes, and "
            "a calibration would raise them again; give the prints, or scores of fpmatch evaluate "
            f"--matcher {chosen.name}",
            path=source,
        )
    return choose_matcher(sets, chosen.name, source)


def impostors_of_report(report: EvaluationReport) -> list[ImpostorSet]:
    """Return the impostor comparisons of an evaluation, a database each.

    Pairs with an image that gave no template are left out: their similarity of 0 would make the
    matcher look more certain than it is.
    """
    return [ImpostorSet(one.name, one.impostors) for one in scores_of(report)]
