"""Evaluation of matchers on databases: extract, compare, count errors."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from fpmatch.errors import DatasetError
from fpmatch.gallery.engine.engine import processes
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.lab.evaluation.databases.comparison import compare_sets
from fpmatch.lab.evaluation.databases.dataset import Dataset, load_dataset
from fpmatch.lab.evaluation.databases.extraction import extract_datasets
from fpmatch.lab.evaluation.databases.protocol import choose_pairs
from fpmatch.lab.evaluation.report.score_reports import summarise, summarise_set
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.listing.entry import NamePattern
    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet, Extractor
    from fpmatch.lab.evaluation.report.results import EvaluationReport
    from fpmatch.matching.result import Matcher


def evaluate(
    datasets: Dataset | str | os.PathLike[str] | Sequence[Dataset | str | os.PathLike[str]],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    protocol: str = "extended",
    workers: int | None = None,
    progress: Progress = no_progress,
    extractor: Extractor | None = None,
    pattern: str | NamePattern | None = None,
    by_folder: bool = False,
) -> EvaluationReport:
    r"""Evaluate a matcher on databases.

    Parameters
    ----------
    datasets : Dataset, path or str, or sequence of these
        The databases, or their folders, manifests or galleries; see
        `fpmatch.lab.evaluation.databases.dataset.load_dataset`, which also takes a list of pairs.
    matcher : str or Matcher
        The matcher, or its name.
    protocol : str
        "extended" or "fvc"; see `choose_pairs`.
    workers : int, optional
        Processes to use (default: one a core). The results are the same for any number.
    progress : callable
        Called as ``progress(stage, done, total)`` for the stages "extract" and "compare".
    extractor : callable
        Makes a template from a path and a resolution; see `extract_datasets`.
    pattern, by_folder
        Where the names or subfolders of folders contain the fingers, as for `load_dataset`.

    Raises
    ------
    DatasetError
        If a database cannot be read, is given twice or has nothing to compare, or the protocol is
        unknown.
    GalleryError
        If a gallery cannot be read, or the pattern is none.
    MatcherError
        If the matcher is unknown.
    FpmatchError
        If a worker process died.

    Examples
    --------
    >>> from fpmatch import evaluate
    >>> report = evaluate(["fvc2002/DB1_B", "fvc2002/DB2_B"])  # doctest: +SKIP
    >>> report.pooled.eer  # doctest: +SKIP
    0.0123
    >>> evaluate(["manifest.csv"]).genuine  # doctest: +SKIP
    240
    >>> evaluate(["scans"], pattern=r"(?P<subject>\w+)-\d").genuine  # doctest: +SKIP
    240
    """
    given = [datasets] if isinstance(datasets, Dataset | str | os.PathLike) else datasets
    (report,) = evaluate_matchers(
        load_datasets(given, protocol, pattern=pattern, by_folder=by_folder),
        [matcher],
        protocol=protocol,
        workers=workers,
        progress=progress,
        extractor=extractor,
    )
    return report


def evaluate_matchers(
    datasets: Sequence[Dataset | str | os.PathLike[str]],
    matchers: Sequence[str | Matcher],
    *,
    protocol: str = "extended",
    workers: int | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    extractor: Extractor | None = None,
) -> list[EvaluationReport]:
    """Evaluate some matchers on the same templates, extracted once.

    `datasets`, `protocol`, `workers`, `progress`, `extractor`: as for `evaluate`. `matchers`: the
    matchers, or their names. `engine`: an engine to work on instead of `workers` processes; it is
    released at the end.
    Raises an `FpmatchError` as `evaluate`.
    """
    loaded = load_datasets(datasets, protocol)
    chosen = [get_matcher(m) if isinstance(m, str) else m for m in matchers]
    with engine or processes(workers) as place:
        extracted = extract_datasets(loaded, extractor=extractor, engine=place, progress=progress)

        def part_of_progress(index: int) -> Progress:
            parts = len(chosen)
            return lambda stage, done, n: progress(stage, index * n + done, parts * n)

        return [
            evaluate_templates(
                extracted,
                matcher=matcher,
                protocol=protocol,
                engine=place,
                progress=part_of_progress(k),
            )
            for k, matcher in enumerate(chosen)
        ]


def evaluate_templates(
    sets: Sequence[ExtractedSet],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    protocol: str = "extended",
    workers: int | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
) -> EvaluationReport:
    """Evaluate a matcher on templates that `extract_datasets` has made; else as `evaluate`.

    `engine` is as for `fpmatch.gallery.engine.workers.run_chunks`.
    """
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    pairs = [one.dataset.pairs or choose_pairs(one.dataset.impressions, protocol) for one in sets]
    if any(one.dataset.pairs is not None for one in sets):
        protocol = "list"
    outcomes = compare_sets(
        sets,
        pairs,
        chosen,
        workers=workers,
        engine=engine,
        progress=progress,
    )
    rows = [summarise_set(chosen.name, *row) for row in zip(sets, pairs, outcomes, strict=True)]
    return summarise(chosen.name, protocol, rows)


def load_datasets(
    datasets: Sequence[Dataset | str | os.PathLike[str]],
    protocol: str = "extended",
    *,
    pattern: str | NamePattern | None = None,
    by_folder: bool = False,
    pairs: str | os.PathLike[str] | None = None,
) -> list[Dataset]:
    """Load the databases among `datasets` that are given as folders, manifests or galleries.

    Other parameters are as for `load_dataset`. Raises what that raises, and a `DatasetError` if
    there is none, one is given twice, a list of pairs comes with several, or one has no pair to
    compare.
    """
    if pairs is not None and len(datasets) != 1:
        raise DatasetError("a list of pairs goes with one database")
    loaded = [
        d
        if isinstance(d, Dataset)
        else load_dataset(d, pattern=pattern, by_folder=by_folder, pairs=pairs)
        for d in datasets
    ]
    if not loaded:
        raise DatasetError("no database given")
    seen: set[Path] = set()
    for dataset in loaded:
        if not len(dataset.pairs or choose_pairs(dataset.impressions, protocol)):
            raise DatasetError(f"{dataset.name}: has no two prints that the protocol compares")
        first = dataset.impressions[0].path.resolve()
        key, name = first, dataset.place or first.parent
        if dataset.place and not Path(dataset.place).is_dir():
            key = Path(dataset.place).resolve()
        if key in seen:
            raise DatasetError(f"{name}: database given twice")
        seen.add(key)
    return loaded
