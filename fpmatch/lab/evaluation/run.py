"""Evaluation: plan the pairs of a protocol, score them, and compute the rates of any scores."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections import Counter
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch._version import __version__
from fpmatch.base.folders import make_folder
from fpmatch.base.output import atomic_write, check_writable
from fpmatch.errors import DatasetError
from fpmatch.gallery.batch.score import COMPARE, score
from fpmatch.gallery.engine.engine import make_engine
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.lab.evaluation.databases.dataset import Dataset, choose_pairs, load_dataset
from fpmatch.lab.evaluation.databases.extraction import DatasetSource
from fpmatch.lab.evaluation.rates.bootstrap import CHANCE
from fpmatch.lab.evaluation.rates.scores import (
    finger_in_name,
    read_genuine_and_impostor,
    read_scores,
)
from fpmatch.lab.evaluation.report.results import RatesReport, SetRates
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.batch.plan import GivenPairs
    from fpmatch.lab.evaluation.databases.extraction import Extractor
    from fpmatch.lab.evaluation.rates.scores import ScoresSet
    from fpmatch.matching.result import Matcher

    AnyPath = str | os.PathLike[str]
    AnyDataset = Dataset | AnyPath


def evaluate(
    datasets: AnyDataset | Sequence[AnyDataset],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    protocol: str = "extended",
    workers: int | None = None,
    progress: Progress = no_progress,
    extractor: Extractor | None = None,
    pattern: str | None = None,
) -> RatesReport:
    r"""Evaluate a matcher on databases.

    `datasets`: a database, or some: folders, manifests, or what
    `fpmatch.lab.evaluation.databases.dataset.load_dataset` returns. `matcher`: it, or its name.
    `protocol`: "extended" or "fvc", see `choose_pairs`. `workers`: processes to use (default: one a
    core); the results are the same for any number. `progress`: called as ``progress(stage, done,
    total)`` for the stages "extract" and "compare" of each database. `extractor`: makes a template
    from a path and a resolution (None: the file's own), alone or in a
    `fpmatch.gallery.listing.prints.ExtractedPrint`; a function at the top of a module, or with one
    worker any. `pattern`: where names of prints contain the fingers, as for `load_dataset`. Raises
    a `DatasetError` if a database cannot be read, is given twice or has nothing to compare, or the
    protocol is unknown; another `FpmatchError` if the matcher is unknown, the pattern is none, or a
    worker process died.

    Examples
    --------
    >>> from fpmatch import evaluate
    >>> report = evaluate(["fvc2002/DB1_B", "fvc2002/DB2_B"])  # doctest: +SKIP
    >>> report.pooled.eer  # doctest: +SKIP
    0.0123
    >>> evaluate(["scans"], pattern=r"(?P<subject>\w+)-\d").genuine  # doctest: +SKIP
    240
    """
    given = [datasets] if isinstance(datasets, Dataset | str | os.PathLike) else datasets
    (report,) = evaluate_matchers(
        load_datasets(given, pattern=pattern),
        [matcher],
        protocol=protocol,
        workers=workers,
        progress=progress,
        extractor=extractor,
    )
    return report


def evaluate_matchers(
    datasets: Sequence[AnyDataset],
    matchers: Sequence[str | Matcher],
    *,
    protocol: str = "extended",
    workers: int | None = None,
    progress: Progress = no_progress,
    scores: str | os.PathLike[str] | None = None,
    **reading: Any,
) -> list[RatesReport]:
    """Evaluate some matchers on the same templates, extracted once.

    `datasets`, `protocol`, `workers`, `progress`: as for `evaluate`. `matchers`: the matchers, or
    their names. `scores`: a CSV file for all comparisons, a database after the other, in the form
    of `fpmatch score`; the state of an interrupted run is kept beside it, and the same call resumes
    the run. `reading`: how the images are read, as for `DatasetSource`. Raises an `FpmatchError` as
    `evaluate`; an `OutputError` if the file cannot be written.
    """
    sources = [DatasetSource(one, **reading) for one in load_datasets(datasets)]
    chosen = [get_matcher(one) if isinstance(one, str) else one for one in matchers]
    plans = [choose_pairs(one.dataset.impressions, protocol) for one in sources]
    if scores is None:
        kept: Any = tempfile.TemporaryDirectory(prefix="fpmatch-")
    else:
        check_writable(scores)
        kept = nullcontext(f"{os.fspath(scores)}.parts")
        make_folder(kept.enter_result)
    reports, files = [], []
    with kept as folder, make_engine(workers) as engine:
        how: dict[str, Any] = {"engine": nullcontext(engine), "lasting": scores is not None}
        for matcher in chosen:
            rows = []
            for source, plan in zip(sources, plans, strict=True):
                file, about = _scored(Path(folder), source, plan, matcher, progress, how)
                fingers = dict(zip(source.names, source.fingers, strict=True))
                (read,) = read_scores(file, finger_of=fingers.get)
                rows.append(SetRates.of(read, about, source))
                files.append(file)
            reports.append(RatesReport.of(rows, protocol))
        if scores is not None:
            _join(files, scores)
            shutil.rmtree(folder)
    return reports


def _scored(
    folder: Path,
    source: DatasetSource,
    plan: GivenPairs,
    matcher: Matcher,
    progress: Progress,
    how: dict[str, Any],
) -> tuple[Path, dict[str, Any]]:
    """Score the pairs of a database, unless an interrupted run has done so.

    Returns the file of scores, and what is known of the prints, as JSON values.
    """
    state = __version__, matcher.name, source.place, source.content_hash, plan.identity
    name = hashlib.sha256(repr((*state, source.title)).encode()).hexdigest()[:16]
    file, beside = folder / f"{name}.csv", folder / f"{name}.json"
    if file.exists() and beside.exists():
        return file, json.loads(beside.read_text(encoding="utf-8"))

    def show(stage: str, done: int, total: int) -> None:
        progress(COMPARE if stage == COMPARE else "extract", done, total)

    done = score(source, source, file, pairs=plan, matcher=matcher, progress=show, **how)
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


def load_datasets(datasets: Sequence[AnyDataset], **how: Any) -> list[Dataset]:
    """Load the databases among `datasets` that are given as folders or manifests.

    `how` is as for `load_dataset`. Databases of one name are named as their folders. Raises what
    that raises, and a `DatasetError` if there is none, one is given twice, or one has no pair to
    compare.
    """
    loaded = [one if isinstance(one, Dataset) else load_dataset(one, **how) for one in datasets]
    if not loaded:
        raise DatasetError("no database given")
    seen: set[Path] = set()
    for dataset in loaded:
        if len(dataset.impressions) < 2:  # any two are a pair of either protocol
            raise DatasetError(f"{dataset.name}: has no two prints that the protocol compares")
        place = Path(dataset.place).resolve()
        if place in seen:
            raise DatasetError(f"{dataset.place}: database given twice")
        seen.add(place)
    times = Counter(one.name for one in loaded)
    return [replace(one, name=_own_name(one)) if times[one.name] > 1 else one for one in loaded]


def _own_name(dataset: Dataset) -> str:
    place = Path(dataset.place).resolve()
    return csv_cell(place.stem if place.is_file() else place.name)


def evaluate_scores(
    files: Sequence[AnyPath] = (),
    *,
    genuine_and_impostor: Sequence[tuple[AnyPath, AnyPath]] = (),
    distances: bool = False,
    pattern: str | None = None,
) -> list[RatesReport]:
    r"""Compute the error rates of scores in files, one report a matcher.

    `files`: files of scores, see `fpmatch.lab.evaluation.rates.scores`. Without a column
    ``matcher``, or where files have scores of the same matcher and database, the matcher is named
    after the file. Without a column ``set`` the database is the only one that other files name, if
    any. `genuine_and_impostor`: files of genuine, and of impostor scores of a matcher, which is
    named after the first. `distances`: whether lower scores are more similar. `pattern`: finds the
    fingers in names of prints, as for `fpmatch.gallery.listing.entry.NamePattern`; by default
    prints are named FFF_M. Raises a `DatasetError` if there is no file, one cannot be read, or a
    matcher comes twice; a `GalleryError` if the pattern is none.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.lab.evaluation.run import evaluate_scores
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "mine.csv")
    ...     _ = file.write_text("probe,reference,score\n1_1,1_2,.9\n1_1,2_1,.2\n1_2,2_1,.1\n")
    ...     (report,) = evaluate_scores([file])
    >>> report.matcher, report.genuine, report.impostor, report.pooled.eer
    ('mine', 1, 2, 0.0)
    """
    of_name = finger_in_name(pattern)
    given: list[tuple[Path, ScoresSet]] = []
    for file in map(Path, files):
        read = read_scores(file, name="", distances=distances, finger_of=of_name)
        given += [(file, one) for one in read]
    for genuine, impostor in genuine_and_impostor:
        of_pair = read_genuine_and_impostor(genuine, impostor, distances=distances)
        given.append((Path(genuine), replace(of_pair, name="")))
    if not given:
        raise DatasetError("no file of scores given")
    named = {one.name for _, one in given if one.name}
    name = named.pop() if len(named) == 1 else "scores"
    times = Counter((one.matcher, one.name or name) for _, one in given)
    by_matcher: dict[str, dict[str, SetRates]] = {}
    for file, one in given:
        matcher, of_set = one.matcher, one.name or name
        if not matcher or times[matcher, of_set] > 1:
            matcher = f"{matcher} ({file.stem})" if matcher else file.stem
        sets = by_matcher.setdefault(matcher, {})
        if of_set in sets:
            raise DatasetError(f"two files of scores of the same name: {matcher}")
        sets[of_set] = SetRates.of(replace(one, matcher=matcher, name=of_set))
    return [RatesReport.of(list(sets.values())) for sets in by_matcher.values()]


def notes_on(report: RatesReport) -> list[str]:
    """Return what a user should know of how the scores of a report were understood."""
    notes = []
    if failed := sum(int((~one.compared).sum()) for one in report.scores):
        total = sum(one.compared.size for one in report.scores)
        notes.append(f"{failed:,} of {total:,} comparisons have no score and count as the lowest")
    if not all(one.fingers for one in report.trials):
        unknown = "its fingers are not known: there are no 95 % intervals"
        notes.append(f"{unknown}; --pattern finds fingers in names of prints")
    if report.pooled.eer is not None and report.pooled.eer > CHANCE:
        wrong = "genuine scores are mostly lower than impostor scores"
        notes.append(f"{wrong}: distances need --distances")
    return notes
