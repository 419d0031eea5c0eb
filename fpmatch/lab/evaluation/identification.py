"""Error rates of identification, from the candidate lists of any system.

With N subjects enrolled, a list of candidates for each search, and a threshold T:

- FPIR(N, T), the false positive identification rate, is the share of the non-mated searches, whose
  subject is not enrolled, that return a candidate with a score of T or more;
- FNIR(N, R, T), the false negative identification rate, is the share of the mated searches that do
  not return their mate among the first R candidates with such a score.

Candidates are subjects; one that comes several times counts with its highest score. A tie counts
against the mate. A search without a template is a miss where it is mated, and else returns nothing.

References
----------
ISO/IEC 19795-1, "Biometric performance testing and reporting"; Grother, Ngan, Hanaoka, "Face
Recognition Vendor Test, part 2: Identification", NISTIR 8271, for FNIR(N, R, T).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError, OutputError
from fpmatch.gallery.listing.csv_rows import csv_rows, row_error
from fpmatch.gallery.listing.entry import NamePattern
from fpmatch.gallery.listing.manifest import kind_of
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.lab.evaluation.rates.bootstrap import (
    CONFIDENCE,
    DEFAULT_BOOTSTRAP,
    MIN_FINGERS,
    RankedScores,
    draw_fingers,
    interval_of,
    with_limit,
)
from fpmatch.lab.evaluation.rates.error_rates import fnmr_at_fmr, threshold_at_fmr
from fpmatch.lab.evaluation.rates.scores import Trials
from fpmatch.lab.evaluation.report.figures import new_axes, series_look
from fpmatch.lab.evaluation.report.text import bounds_note, limits, percent
from fpmatch.lab.plots.style import check_plot, plain_style, save_figure
from fpmatch.printable import text_table

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    AnyPath = str | os.PathLike[str]

FPIRS: Final = (0.001, 0.01, 0.1)
RANKS: Final = (1, 5, 10)
SEED: Final = 0  # of the bootstrap
_DET_FPIRS: Final = tuple(np.logspace(-4, 0, 41)[:-1].tolist())  # ten a decade


@dataclass(slots=True)
class Search:
    """One search: the subject of the probe, and the highest score of each candidate."""

    subject: str
    candidates: dict[str, float] = field(default_factory=dict)


def enrolled_subjects(place: AnyPath, pattern: str | None = None) -> set[str]:
    """Return the subjects of a gallery, of a folder or manifest of prints, or of a CSV file.

    The file has a column ``subject``. Names of prints contain the subject: FFF of FFF_M, or by a
    `pattern` as for `fpmatch.gallery.listing.entry.NamePattern`. Raises an FpmatchError if the
    place cannot be read, and a DatasetError if it names no subject.
    """
    kind = kind_of(place)
    if kind == "gallery":
        from fpmatch.gallery.gallery import open_gallery  # noqa: PLC0415  (imports a database)

        with open_gallery(place) as gallery:
            subjects = {entry.label.subject for entry in gallery.entries()}
    elif kind == "file":
        subjects = {cells["subject"] for _, cells in _rows(place, ("subject",))} - {""}
    else:
        names = NamePattern(*filter(None, [pattern]))
        files = find_prints([place], pattern=names if pattern else None)
        labels = [file.label or names.label(file.path) for file in files]
        subjects = {label.subject for label in labels if label is not None}
    if not subjects:
        raise DatasetError("names no subject (--pattern finds them in names)", path=place)
    return subjects


def read_candidates(path: AnyPath, enrolled: set[str], pattern: str | None = None) -> list[Search]:
    """Read the searches of a CSV file of candidates: of ``fpmatch identify -o``, or of any system.

    The first line has the names of the columns: ``probe``, ``subject`` and ``score``, greater for
    more similar prints, and perhaps ``probe_subject``; others are not read. There is a row for each
    candidate, and one without a subject for a search that returned none. Without ``probe_subject``
    the name of the probe contains the subject, as for `enrolled_subjects`. Raises a `DatasetError`
    if the file cannot be read, or a candidate or a probe has no known subject, with the line.
    """
    names, refused = NamePattern(*filter(None, [pattern])), partial(row_error, DatasetError, path)
    searches: dict[str, Search] = {}
    for line, cells in _rows(path, ("probe", "subject", "score")):
        probe, subject = cells["probe"], cells["subject"]
        if probe not in searches:
            label = names.label(Path(probe))
            of_probe = cells.get("probe_subject") or (label and label.subject)
            if not of_probe:
                why = f"the subject of probe {probe!r} is not known (--pattern finds it in names)"
                raise refused(line, why)
            searches[probe] = Search(of_probe)
        if not subject:
            continue
        if subject not in enrolled:
            raise refused(line, f"candidate {subject!r} is not enrolled")
        try:
            value = float(cells["score"])
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise refused(line, f"score {cells['score']!r} is no finite number")
        candidates = searches[probe].candidates
        candidates[subject] = max(value, candidates.get(subject, value))
    if not searches:
        raise DatasetError("holds no search", path=path)
    return list(searches.values())


def _rows(path: AnyPath, needed: Sequence[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield line number and cells of the rows of a CSV file whose first line names its columns."""
    rows = csv_rows(path, DatasetError)
    line, head = next(rows, (1, []))
    if missing := [name for name in needed if name not in head]:
        why = f"the first line names no column {missing[0]!r}; needed: {', '.join(needed)}"
        raise row_error(DatasetError, path, line, why)
    for line, row in rows:
        yield line, dict(zip(head, [*row, *[""] * len(head)], strict=False))


def identification_rates(
    searches: Sequence[Search],
    subjects: set[str],
    *,
    name: str = "",
    fpirs: Sequence[float] = (),
    bootstrap: int = DEFAULT_BOOTSTRAP,
) -> dict[str, Any]:
    """Compute the error rates of searches among enrolled `subjects`, as JSON values.

    `fnir_at_rank`, `fnir_at_fpir` (at `fpirs`, default: `FPIRS`) and `det` are points with their
    `fnir`, its 95 % `interval` and the `threshold` on the score; a rate is None where there are
    fewer than 1 / FPIR non-mated searches. The bootstrap draws the subjects of the probes, each
    with all its searches; the gallery is not drawn. With fewer than five subjects, only rates of 0
    and 1 have an interval. Raises a `DatasetError` without a mated search.

    Examples
    --------
    >>> from fpmatch.lab.evaluation.identification import Search, identification_rates
    >>> found, missed = Search("a", {"a": 9.0, "b": 1.0}), Search("b", {"a": 2.0})
    >>> rates = identification_rates([found, missed, Search("c", {"a": 3.0})], {"a", "b"})
    >>> rates["mated"], rates["nonmated"], rates["fnir_at_rank"][0]["fnir"]
    (2, 1, 0.5)
    """
    mated = [one for one in searches if one.subject in subjects]
    others = [one for one in searches if one.subject not in subjects]
    if not mated:
        raise DatasetError(f"{name}: no probe's subject is enrolled")
    every = [score for one in searches for score in one.candidates.values()]
    nothing = min(every, default=0.0) - 1.0  # below all scores: of what is not listed
    mates = np.array([one.candidates.get(one.subject, nothing) for one in mated])
    highest = np.array([max(one.candidates.values(), default=nothing) for one in others])
    ranks = np.array([_rank(one) for one in mated])
    units = len({one.subject for one in mated})
    numbers = {one: k for k, one in enumerate(dict.fromkeys(each.subject for each in searches))}
    weights = None
    if bootstrap and len(numbers) >= MIN_FINGERS:
        drawn = draw_fingers(len(numbers), bootstrap, SEED)
        weights = drawn[:, [numbers[one.subject] for one in (*mated, *others)]]

    def point(at: Any, fnir: float | None, draws: Any, threshold: float | None) -> dict[str, Any]:
        interval = bound = None
        if fnir is not None and bootstrap:
            drawn = None if draws is None else interval_of(draws)
            interval, bound = with_limit(drawn, fnir, units, "subject")
        limits = {"interval": interval, "bound": bound}
        return {**at, "fnir": fnir, "threshold": threshold, **limits}

    at_rank = []
    for rank in (one for one in RANKS if one == 1 or one < len(subjects)):
        missed, draws = ranks > rank, None
        if weights is not None:
            of_mated = weights[:, : len(mated)]
            with np.errstate(invalid="ignore"):  # a draw without mated searches has no rate
                draws = (of_mated @ missed) / of_mated.sum(axis=1)
        at_rank.append(point({"rank": rank}, float(missed.mean()), draws, None))
    asked = fpirs or FPIRS
    wanted = [*asked, *(f for f in _DET_FPIRS if f * len(others) >= 1)]
    columns: list[Any] = [None] * len(wanted)
    if weights is not None and others:
        is_mated = np.arange(len(searches)) < len(mated)
        trials = Trials.without_fingers(np.concatenate([mates, highest]), is_mated)
        ranked = RankedScores([trials])
        columns = list(np.array([ranked.rates(drawn, wanted)[1:] for drawn in weights]).T)
    at_fpir = []
    for fpir, draws in zip(wanted, columns, strict=True):
        fnir = fnmr_at_fmr(mates, highest, fpir)
        below = None if fnir is None else threshold_at_fmr(highest, fpir)
        above = [] if below is None else [score for score in every if score > below]
        at_fpir.append(point({"fpir": fpir}, fnir, draws, min(above, default=None)))
    counts = {"enrolled": len(subjects), "mated": len(mated), "nonmated": len(others)}
    at = {"fnir_at_fpir": at_fpir[: len(asked)], "det": at_fpir[len(asked) :]}
    return {"name": name, **counts, "fnir_at_rank": at_rank, **at}


def _rank(one: Search) -> float:
    """Return the rank of the mate, infinite where it is not listed; ties count against it."""
    mate = one.candidates.get(one.subject, math.inf)
    return sum(score >= mate for score in one.candidates.values()) or math.inf


def evaluate_candidates(
    files: Sequence[AnyPath],
    enrolled: AnyPath,
    *,
    pattern: str | None = None,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    fpirs: Sequence[float] = (),
) -> dict[str, Any]:
    """Return the error rates of the searches in files of candidates, `systems`, as JSON values.

    `enrolled` is as for `enrolled_subjects`, all else as for `identification_rates`.
    """
    subjects = enrolled_subjects(enrolled, pattern)
    systems = []
    for file in files:
        searches, name = read_candidates(file, subjects, pattern), Path(file).stem
        how: dict[str, Any] = {"name": name, "fpirs": fpirs, "bootstrap": bootstrap}
        systems.append(identification_rates(searches, subjects, **how))
    draws = {"confidence": CONFIDENCE, "bootstrap": bootstrap, "seed": SEED}
    return {"protocol": "identification", **draws, "systems": systems}


def identification_text(document: dict[str, Any]) -> str:
    """Return a table of the rates of some systems, with their intervals, in percent."""
    rows: list[tuple[str, ...]] = [
        ("FNIR at", "enrolled", "mated", "non-mated", "", "FNIR", "95 % interval", "threshold")
    ]
    bounds = []
    for system in document["systems"]:
        cells = [str(system[name]) for name in ("name", "enrolled", "mated", "nonmated")]
        for point in (*system["fnir_at_rank"], *system["fnir_at_fpir"]):
            at = f"rank {point['rank']}" if "rank" in point else f"FPIR {100 * point['fpir']:.6g} %"
            none = point["fnir"] is None or not document["bootstrap"]
            interval = "-" if none else limits(point["interval"], point["bound"])
            threshold = "" if point["threshold"] is None else f"{point['threshold']:.6g}"
            rows.append((*cells, at, percent(point["fnir"]), interval, threshold))
            cells = [""] * len(cells)
            bounds.append(point["bound"])
    return "\n\n".join(filter(None, (text_table(rows), bounds_note(bounds))))


def save_identification_det(path: AnyPath, document: dict[str, Any]) -> None:
    """Draw FNIR against FPIR, a line a system; a rate of 0 is drawn at half a search.

    Raises an `OutputError` as `check_plot`, and where there are no non-mated searches.
    """
    check_plot(path)
    systems = document["systems"]
    if not all(system["det"] for system in systems):
        raise OutputError(f"{path}: a DET needs mated and non-mated searches")
    with plain_style():
        figure, axes = new_axes()
        for k, system in enumerate(systems):
            fnir = [max(point["fnir"], 0.5 / system["mated"]) for point in system["det"]]
            fpir = [point["fpir"] for point in system["det"]]
            axes.plot(fpir, fnir, label=system["name"], **series_look(k))
        axes.set(xlabel="FPIR, %", ylabel="FNIR, %", xscale="log", yscale="log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_formatter("")
            axis.set_major_formatter(lambda share, _: f"{100 * share:.6g}")
        axes.grid(visible=True, linewidth=0.4)
        axes.legend(frameon=False)
        save_figure(path, figure)
