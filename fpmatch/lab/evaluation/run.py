"""Evaluation of matchers on databases: plan the pairs of a protocol, score them, compute rates."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from fpmatch._version import __version__
from fpmatch.base.folders import make_folder
from fpmatch.base.output import atomic_write, check_writable
from fpmatch.errors import DatasetError
from fpmatch.gallery.batch.score import COMPARE, score
from fpmatch.gallery.engine.engine import processes
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.lab.evaluation.databases.dataset import Dataset, load_dataset
from fpmatch.lab.evaluation.databases.extraction import DatasetSource, Reading
from fpmatch.lab.evaluation.databases.protocol import PairPlan, choose_pairs
from fpmatch.lab.evaluation.rates.scores import read_scores
from fpmatch.lab.evaluation.report.results import RatesReport, SetRates
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.listing.entry import NamePattern
    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet, Extractor
    from fpmatch.matching.result import Matcher

    AnyDataset = Dataset | str | os.PathLike[str]

PARTS: Final = ".parts"


def evaluate(
    datasets: AnyDataset | Sequence[AnyDataset],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    protocol: str = "extended",
    workers: int | None = None,
    progress: Progress = no_progress,
    extractor: Extractor | None = None,
    pattern: str | NamePattern | None = None,
    by_folder: bool = False,
) -> RatesReport:
    r"""Evaluate a matcher on databases.

    Parameters
    ----------
    datasets : Dataset, path or str, or sequence of these
        The databases, or their folders, manifests or galleries; see
        `fpmatch.lab.evaluation.databases.dataset.load_dataset`.
    matcher : str or Matcher
        The matcher, or its name.
    protocol : str
        "extended" or "fvc"; see `choose_pairs`.
    workers : int, optional
        Processes to use (default: one a core). The results are the same for any number.
    progress : callable
        Called as ``progress(stage, done, total)`` for the stages "extract" and "compare".
    extractor : callable
        Makes a template from a path and a resolution (None: the file's own), alone or in a
        `fpmatch.gallery.listing.prints.ExtractedPrint`; a function at the top of a module, or with
        one worker any.
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
        reading=Reading(extractor=extractor),
    )
    return report


def evaluate_matchers(
    datasets: Sequence[AnyDataset],
    matchers: Sequence[str | Matcher],
    *,
    protocol: str = "extended",
    workers: int | None = None,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    reading: Reading = Reading(),  # noqa: B008
    scores: str | os.PathLike[str] | None = None,
) -> list[RatesReport]:
    """Evaluate some matchers on the same templates, extracted once.

    `datasets`, `protocol`, `workers`, `progress`: as for `evaluate`. `matchers`: the matchers, or
    their names. `engine`: an engine to work on instead of `workers` processes; it is released at
    the end. `reading`: how the images are read. `scores`: a CSV file for all comparisons, a
    database after the other, in the form of `fpmatch score`; the state of an interrupted run is
    kept beside it, and the same call resumes the run. Raises an `FpmatchError` as `evaluate`; an
    `OutputError` if the file cannot be written.
    """
    sources = [DatasetSource(one, reading) for one in load_datasets(datasets, protocol)]
    return _evaluate(sources, matchers, protocol, engine or processes(workers), progress, scores)


def evaluate_templates(
    sets: Sequence[ExtractedSet],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    protocol: str = "extended",
    workers: int | None = None,
) -> RatesReport:
    """Evaluate a matcher on templates that `extract_datasets` has made; else as `evaluate`."""
    sources = [DatasetSource.of(one) for one in sets]
    (report,) = _evaluate(sources, [matcher], protocol, processes(workers), no_progress, None)
    return report


def _evaluate(
    sources: Sequence[DatasetSource],
    matchers: Sequence[str | Matcher],
    protocol: str,
    engine: Engine,
    progress: Progress,
    scores: str | os.PathLike[str] | None,
) -> list[RatesReport]:
    chosen = [get_matcher(one) if isinstance(one, str) else one for one in matchers]
    plans = [PairPlan(choose_pairs(one.dataset.impressions, protocol)) for one in sources]
    progress = _over_all(progress, sources, plans, len(chosen))
    if scores is None:
        kept: Any = tempfile.TemporaryDirectory(prefix="fpmatch-")
    else:
        check_writable(scores)
        kept = nullcontext(f"{os.fspath(scores)}{PARTS}")
        make_folder(kept.enter_result)
    reports, files = [], []
    with kept as folder, engine as place:
        for matcher in chosen:
            rows = []
            for source, plan in zip(sources, plans, strict=True):
                file, about = _scored(Path(folder), source, plan, matcher, place, progress)
                (read,) = read_scores(file, finger_of=partial(_finger_of, source))
                rows.append(SetRates.of(read, about, source))
                files.append(file)
            reports.append(RatesReport.of(rows, protocol))
        if scores is not None:
            _join(files, scores)
            shutil.rmtree(folder)
    return reports


def _finger_of(source: DatasetSource, _: str, name: str) -> str | None:
    return source.fingers[source.names.index(name)] or None


def _scored(
    folder: Path,
    source: DatasetSource,
    plan: PairPlan,
    matcher: Matcher,
    engine: Engine,
    progress: Progress,
) -> tuple[Path, dict[str, Any]]:
    """Score the pairs of a database, unless an interrupted run has done so.

    Returns the file of scores, and what is known of the prints, as JSON values.
    """
    state = __version__, matcher.name, source.place, source.content_hash, plan.identity
    name = hashlib.sha256(repr((*state, source.title)).encode()).hexdigest()[:16]
    file, beside = folder / f"{name}.csv", folder / f"{name}.json"
    if file.exists() and beside.exists():
        return file, json.loads(beside.read_text(encoding="utf-8"))
    place = cast("Engine", nullcontext(engine))
    how: dict[str, Any] = {"matcher": matcher, "engine": place, "progress": progress}
    done = score(source, source, file, pairs=plan, **how)
    about = {
        "failures": {one.name: one.reason for one in done.failures},
        "dpi_assumed": list(done.dpi_assumed),
        "noted": {note: list(names) for note, names in done.noted.items()},
        "identical": {"count": done.identical, "pairs": list(map(list, done.identical_pairs))},
    }
    with atomic_write(beside) as stream:
        stream.write(json.dumps(about).encode())
    return file, about


def _join(files: Sequence[Path], target: str | os.PathLike[str]) -> None:
    """Write the rows of some files of scores into one."""
    with atomic_write(target) as stream:
        for k, file in enumerate(files):
            with file.open("rb") as part:
                head = part.readline()
                if not k:
                    stream.write(head)
                shutil.copyfileobj(part, stream)


def _over_all(
    progress: Progress, sources: Sequence[DatasetSource], plans: Sequence[PairPlan], times: int
) -> Progress:
    """Return what `score` calls with the progress of one database and stage after the other."""
    totals = {
        "extract": sum(len(one.names) for one in sources),
        COMPARE: times * sum(map(len, plans)),
    }
    before = dict.fromkeys(totals, 0)

    def show(stage: str, done: int, total: int) -> None:
        stage = COMPARE if stage == COMPARE else "extract"
        progress(stage, min(before[stage] + done, totals[stage]), totals[stage])
        if done == total:
            before[stage] += total

    return show


def load_datasets(
    datasets: Sequence[AnyDataset],
    protocol: str = "extended",
    *,
    pattern: str | NamePattern | None = None,
    by_folder: bool = False,
) -> list[Dataset]:
    """Load the databases among `datasets` that are given as folders, manifests or galleries.

    Other parameters are as for `load_dataset`. Raises what that raises, and a `DatasetError` if
    there is none, one is given twice, or one has no pair to compare.
    """
    loaded = [
        d if isinstance(d, Dataset) else load_dataset(d, pattern=pattern, by_folder=by_folder)
        for d in datasets
    ]
    if not loaded:
        raise DatasetError("no database given")
    seen: set[Path] = set()
    for dataset in loaded:
        if not len(choose_pairs(dataset.impressions, protocol)):
            raise DatasetError(f"{dataset.name}: has no two prints that the protocol compares")
        first = dataset.impressions[0].path.resolve()
        key, name = first, dataset.place or first.parent
        if dataset.place and not Path(dataset.place).is_dir():
            key = Path(dataset.place).resolve()
        if key in seen:
            raise DatasetError(f"{name}: database given twice")
        seen.add(key)
    return loaded
