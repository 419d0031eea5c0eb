"""`fpmatch evaluate`: error rates on databases of prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.base.kernels import build_command, outdated_kernels
from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.options import enhance_option, file_option, reading_options
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import FpmatchError
from fpmatch.gallery.cli.notes import notes_as_json, say_dpi_assumed
from fpmatch.gallery.cli.options import (
    FROM_0,
    by_folder_option,
    key_option,
    pattern_option,
    places_argument,
    workers_option,
)
from fpmatch.lab.cli.columns import GROUND_TRUTH, RATES
from fpmatch.lab.cli.matchers import chosen_matchers, matchers_option
from fpmatch.lab.cli.rates import prepare_outputs, rate_options, write_outputs
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity

_STAGES = {
    "extract": "extracting prints",
    "extract probes": "extracting squares",
    "compare": "comparing pairs",
}


@click.command(
    cls=Command,
    details=RATES
    + GROUND_TRUTH
    + """
The rates of several databases are followed by their mean, and by the rates of all scores pooled.

With --crop every square must give a template, too, for exit status 0; a note on stderr names each
that does not.

\b
More examples:
  fpmatch evaluate fvc2002/DB*_B --enhance filters
  fpmatch evaluate fvc2002/DB1_B --crop 160
  fpmatch evaluate scans --pattern '(?P<subject>\\d+)_(?P<finger>[a-z]+)_(?P<impression>\\d)'
  fpmatch evaluate fvc2002/DB1_B --protocol fvc --baseline scores.csv
  fpmatch evaluate fvc2002/DB1_B --pairs list.csv
  fpmatch evaluate small_sensor --enrol 10 --impostors other_small_prints
  fpmatch evaluate fvc2002/DB1_B --fmr 0.0005 --curves curves
""",
    epilog="""\b
Examples:
  fpmatch evaluate fvc2002/DB1_B
  fpmatch evaluate fvc2002/DB*_B --matcher all --json
  fpmatch evaluate fvc2002/DB1_B --protocol fvc --scores scores.csv
  fpmatch evaluate sample_data --ground-truth --report report

Exit status: 0 when every image gave a template, 1 when some did not, 2 on bad input.
""",
)
@places_argument("places", metavar="DIR|MANIFEST|GALLERY...")
@pattern_option
@by_folder_option
@click.option(
    "--protocol",
    type=click.Choice(["extended", "fvc"]),
    default="extended",
    help="Impostor pairs: all impressions of different fingers, or first impressions only.",
)
@matchers_option
@file_option(
    "--pairs",
    metavar="LIST",
    hidden=True,
    help="Compare these pairs only: columns probe, reference and perhaps genuine (1 or 0).",
)
@reading_options
@enhance_option
@file_option("--scores", metavar="OUT.csv", help="Write every comparison to a CSV file.")
@click.option(
    "--ground-truth",
    is_flag=True,
    help="Measure extraction and transforms too, against the true minutiae in each DIR.",
)
@click.option(
    "--crop",
    metavar="PX",
    type=click.IntRange(min=32, max=4000),
    hidden=True,
    help="Compare a square of PX by PX pixels at 500 dpi, about the centroid of the first print of "
    "each pair, with the whole second print.",
)
@click.option(
    "--enrol",
    "enrolled",
    metavar="N",
    type=click.IntRange(1, 1000),
    hidden=True,
    help="Enrol the first N impressions of every finger together, and compare each other "
    "impression with each finger.",
)
@click.option(
    "--enrol-seed",
    type=FROM_0,
    hidden=True,
    help="Draw the N impressions of --enrol at random, by this seed.",
)
@click.option(
    "--impostors",
    metavar="DIR",
    multiple=True,
    hidden=True,
    help="With --enrol: compare the prints of this database, of other fingers, too; repeatable.",
)
@rate_options
@workers_option
@key_option
def evaluate(
    places: tuple[str, ...],
    pattern: str | None,
    by_folder: bool,
    protocol: str,
    matchers: tuple[str, ...],
    pairs: Path | None,
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    enhance: str,
    scores: Path | None,
    report_folder: Path | None,
    baseline: Path | None,
    bootstrap: int,
    seed: int,
    ground_truth: bool,
    crop: int | None,
    enrolled: int | None,
    enrol_seed: int | None,
    impostors: tuple[str, ...],
    fmrs: tuple[float, ...],
    curves: Path | None,
    det: Path | None,
    table: Path | None,
    as_json: bool,
    workers: int | None,
) -> int:
    """Measure error rates on databases of prints.

    Each DIR contains images or templates named FFF_M.tif (finger FFF, impression M), or named by
    --pattern, or in folders, one a finger; perhaps a dataset.toml with name, dpi and sensor. A
    MANIFEST is as for fpmatch enrol.
    """
    if crop is not None and (ground_truth or report_folder is not None):
        raise click.UsageError("--crop goes with neither --report nor --ground-truth")
    if enrolled is None and (enrol_seed is not None or impostors):
        raise click.UsageError("--enrol-seed and --impostors go with --enrol")
    beside = (report_folder, crop, scores, baseline, pairs, curves)
    if enrolled is not None and (ground_truth or any(one is not None for one in beside)):
        raise click.UsageError(
            "--enrol goes with none of --report, --ground-truth, --crop, --scores, --baseline, "
            "--pairs and --curves"
        )
    if baseline is not None and outdated_kernels():
        raise FpmatchError(
            f"--baseline: kernels are out of date; run `{build_command()}` first, so that what is "
            "compared is what the files say"
        )
    from fpmatch.base.output import check_writable
    from fpmatch.gallery.engine.engine import processes
    from fpmatch.lab.evaluation import cropping, enrolment, run
    from fpmatch.lab.evaluation.databases import dataset, extraction
    from fpmatch.lab.evaluation.ground_truth.report import format_minutiae, measure_minutiae
    from fpmatch.lab.evaluation.ground_truth.truth import load_truth
    from fpmatch.lab.evaluation.rates.scores import read_scores
    from fpmatch.lab.evaluation.report.analysis import Report
    from fpmatch.lab.evaluation.report.score_rows import write_scores
    from fpmatch.prints.reading import PrintReader

    if scores is not None:
        check_writable(scores)
    files = {"report_folder": report_folder, "curves": curves, "det": det, "table": table}
    prepare_outputs(**files)
    earlier = None if baseline is None else read_scores(baseline)
    labels: dict[str, Any] = {"pattern": pattern, "by_folder": by_folder}
    loaded = run.load_datasets(places, protocol, **labels, pairs=pairs)
    datasets = [one.at(dpi) for one in dataset.with_unique_names(loaded)]
    plan = None
    if enrolled is not None:
        others = run.load_datasets([*loaded, *impostors], **labels)[len(loaded) :]
        impostor_sets = tuple(one.at(dpi) for one in dataset.with_unique_names(others))
        plan = enrolment.Enrolment(enrolled, enrol_seed, impostor_sets)
    graded = any(one is not None for one in (scores, report_folder, curves))
    truths = [load_truth(dataset) for dataset in datasets] if ground_truth else []
    say_slow_kernels()
    with processes(workers) as engine, ProgressBars(_STAGES) as bars:
        read = PrintReader(raw, quiet=True)
        reader = extraction.dataset_reader(datasets, read, engine, polarity=polarity)
        results = run.evaluate_matchers(
            datasets,
            chosen_matchers(matchers),
            protocol=protocol,
            engine=engine,
            progress=bars.show,
            extractor=extraction.extractor_of(enhance, reader, graded=graded),
            probe_extractor=(
                None if crop is None else cropping.crop_extractor_of(crop, enhance, reader)
            ),
            enrolment=plan,
        )
    if scores is not None:
        write_scores(scores, *results)
    say_dpi_assumed(results[0].dpi_assumed, "dpi in dataset.toml")
    say_notes(results[0].noted)
    for row in results[0].sets:
        for _, reason in row.failures:
            say_note(f"no template: {reason}")
    draws: dict[str, Any] = {"bootstrap": bootstrap, "seed": seed, "fmrs": fmrs}
    report = Report.of(results, **draws, baseline=earlier, baseline_name=str(baseline))
    write_outputs(report, **files)
    document, text = report.as_json(), report.as_text()
    document["dpi_assumed"] = len(results[0].dpi_assumed)
    document["notes"] = notes_as_json(results[0].noted)
    failed: list[str] = []
    if crop is not None:
        failed = [str(path) for path in cropping.failed_crops(results[0].sets)]
        document["crop"] = {"side_px": crop, "failures": failed}
        text = f"Probes: squares of {crop} by {crop} px at 500 dpi.\n\n{text}"
        for name in failed:
            say_note(f"no template of the square: {name}")
    if plan is not None:
        document["enrol"] = enrolment.enrolment_document(results[0], plan)
        text = f"{enrolment.enrolment_text(document['enrol'])}\n\n{text}"
    if ground_truth:
        measured = measure_minutiae(results[0], truths)
        document["ground_truth"] = measured.as_json()
        text = f"{text}\n\n{format_minutiae(measured)}"
    show(json_text(document) if as_json else text)
    return 1 if failed or any(row.failures for row in results[0].sets) else 0
