"""`fpmatch evaluate-identification`: searches, a third with a mate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.base.threads import fast_imports
from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.options import enhance_option, file_option, reading_options
from fpmatch.cli.progress import ProgressBars
from fpmatch.gallery.cli.notes import notes_as_json, say_dpi_assumed
from fpmatch.gallery.cli.options import (
    by_folder_option,
    key_option,
    pattern_option,
    places_argument,
    workers_option,
)
from fpmatch.lab.cli.columns import IDENTIFICATION
from fpmatch.lab.cli.matchers import chosen_matchers, matchers_option
from fpmatch.lab.cli.rates import bootstrap_options
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet

_STAGES: Final = {
    "extract": "extracting prints",
    "extract background": "extracting background",
    "prepare": "preparing background",
    "search": "searching",
}


@click.command(
    "evaluate-identification",
    cls=Command,
    details=IDENTIFICATION,
    epilog="""\b
Examples:
  fpmatch evaluate-identification fvc2002/DB*_B
  fpmatch evaluate-identification fvc2002/DB*_B --fingers 2
  fpmatch evaluate-identification fvc2002/DB1_B --background prints.db --det det.svg

Exit status: 0 when every image gave a template, 1 when some did not (a note on stderr names each),
2 when the run could not be done.
""",
)
@places_argument("places", metavar="DIR|MANIFEST|GALLERY...")
@pattern_option
@by_folder_option
@matchers_option
@click.option(
    "--background",
    metavar="GALLERY|DIR|MANIFEST",
    help="Fill the gallery with these prints, of fingers that are not in DIR; a gallery is not "
    "changed.",
)
@click.option(
    "--fingers",
    metavar="N",
    type=click.IntRange(1, 10),
    help="Search for N fingers of a subject together, beside one. Where names contain no subjects, "
    "each finger and the next make up one.",
)
@click.option(
    "--fpir",
    "fpirs",
    metavar="RATE",
    type=click.FloatRange(0, 1, min_open=True, max_open=True),
    multiple=True,
    help="Report the FNIR at this false positive identification rate; repeatable (default: 0.001, "
    "0.005 and 0.01).",
)
@file_option(
    "--det", metavar="FILE", help="Draw FNIR against FPIR and rank into a .png, .svg or .pdf."
)
@file_option(
    "--report",
    "report_folder",
    metavar="DIR",
    help="Write a page there: tables, curves, drawings of searches that fail.",
)
@reading_options
@enhance_option
@file_option("--curves", metavar="DIR", hidden=True, help="Write the points of the curves there.")
@bootstrap_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object; rates as fractions.")
@workers_option
@key_option
def evaluate_identification(
    places: tuple[str, ...],
    matchers: tuple[str, ...],
    *,
    pattern: str | None,
    by_folder: bool,
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    enhance: str,
    bootstrap: int,
    seed: int,
    background: str | None,
    fingers: int | None,
    fpirs: tuple[float, ...],
    curves: Path | None,
    det: Path | None,
    report_folder: Path | None,
    workers: int | None,
    as_json: bool,
) -> int:
    """Measure error rates of searches: for each print, in a gallery where a third have a mate.

    Each DIR, MANIFEST or GALLERY is as for fpmatch evaluate.
    """
    with fast_imports():
        from fpmatch.gallery.engine.engine import processes
        from fpmatch.lab.evaluation import run
        from fpmatch.lab.evaluation.databases import dataset, extraction
        from fpmatch.lab.evaluation.open_set.background import load_background
        from fpmatch.lab.evaluation.open_set.rates import FPIRS
        from fpmatch.lab.evaluation.open_set.run import IdentificationTest
        from fpmatch.lab.evaluation.open_set.run import evaluate_identification as evaluate_searches
        from fpmatch.matching.registry import get_matcher
        from fpmatch.prints.reading import PrintReader, group_by_note

    chosen = chosen_matchers(matchers)
    _prepare_outputs(curves, det, report_folder)
    labels: dict[str, Any] = {"pattern": pattern, "by_folder": by_folder}
    loaded = run.load_datasets(places, **labels)
    datasets = [one.at(dpi) for one in dataset.with_unique_names(loaded)]
    reading: dict[str, Any] = {"polarity": polarity, "reader": PrintReader(raw, quiet=True)}
    say_slow_kernels()
    reports: list[Any] = []
    given: dict[str, Any]
    with processes(workers) as engine, ProgressBars(_STAGES) as bars:
        reader = extraction.dataset_reader(datasets, engine=engine, **reading)
        extractor = extraction.extractor_of(enhance, reader)
        how: dict[str, Any] = {"engine": engine, "progress": bars.show}
        sets = extraction.extract_datasets(datasets, extractor=extractor, **how)
        for name in chosen:
            matcher, filled = get_matcher(name), None
            if background is not None:
                given = {"enhance": enhance, "apart_from": datasets, **how, **labels}
                given |= {"dpi": dpi, "reading": reading}
                filled = load_background(background, matcher, **given)
            of_matcher = []
            for size in sorted({1, fingers or 1}, reverse=True):  # first that of fewest subjects
                test = IdentificationTest(size, tuple(fpirs) or FPIRS, bootstrap, seed)
                gallery = None if filled is None else filled.of_subjects(size)
                given = {"matcher": matcher, "test": test, "progress": bars.show}
                of_matcher.append(evaluate_searches(sets, gallery, **given))
            reports += of_matcher[::-1]
    _say_notes(sets)
    _write_outputs(curves, det, report_folder, reports, sets)
    document = {
        "protocol": "identification",
        "tests": [report.as_json() for report in reports],
        "dpi_assumed": sum(len(one.assumed) for one in sets),
        "notes": notes_as_json(group_by_note(note for one in sets for note in one.notes)),
    }
    several = len(chosen) > 1
    texts = [f"matcher {one.matcher}\n" * several + one.as_text() for one in reports]
    show(json_text(document) if as_json else "\n\n".join(texts))
    return 1 if any(one.failures for one in sets) else 0


def _say_notes(sets: Sequence[ExtractedSet]) -> None:
    from fpmatch.prints.reading import group_by_note

    say_dpi_assumed([path for one in sets for path in one.assumed], "dpi in dataset.toml")
    say_notes(group_by_note(note for one in sets for note in one.notes))
    for one in sets:
        for _, reason in one.failures:
            say_note(f"no template: {reason}")


def _prepare_outputs(curves: Path | None, det: Path | None, report_folder: Path | None) -> None:
    """Raise an OutputError if the curves, the DET or the report cannot be written."""
    if curves is not None:
        from fpmatch.lab.evaluation.open_set.curves import prepare_identification_curves

        prepare_identification_curves(curves)
    if det is not None:
        from fpmatch.lab.plots.style import check_plot

        check_plot(det)
    if report_folder is not None:
        from fpmatch.lab.evaluation.open_set.page import IDENTIFICATION_PAGE
        from fpmatch.lab.evaluation.report.page import prepare_page

        prepare_page(report_folder, IDENTIFICATION_PAGE)


def _write_outputs(
    curves: Path | None,
    det: Path | None,
    report_folder: Path | None,
    reports: Sequence[Any],
    sets: Sequence[ExtractedSet],
) -> None:
    """Write the curves, the DET and the report, where requested, and note where they are."""
    if curves is not None:
        from fpmatch.lab.evaluation.open_set.curves import write_identification_curves

        files = write_identification_curves(curves, reports)
        say_note(f"curves: {', '.join(map(str, files))}")
    if det is not None:
        from fpmatch.lab.evaluation.open_set.curves import save_identification_plot

        save_identification_plot(det, reports)
        say_note(f"DET: {det}")
    if report_folder is not None:
        from fpmatch.lab.evaluation.open_set.page import write_identification_page

        say_note(f"report: {write_identification_page(report_folder, reports, sets)}")
