"""`fpmatch evaluate`: error rates on databases of prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.base.kernels import build_command, outdated_kernels
from fpmatch.cli import fast_imports
from fpmatch.cli.notes import ProgressBars, say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.options import enhance_option, file_option, key_option
from fpmatch.errors import FpmatchError
from fpmatch.gallery.cli.notes import notes_as_json, say_dpi_assumed
from fpmatch.gallery.cli.options import (
    FROM_0,
    by_folder_option,
    old_names,
    pattern_option,
    places_argument,
    workers_option,
)
from fpmatch.lab.cli.evaluate_epilog import EPILOG
from fpmatch.lab.cli.evaluate_identification import (
    OPTIONS,
    evaluate_by_searches,
    identification_options,
    refuse_identification_options,
)
from fpmatch.lab.cli.scores_in import (
    evaluate_given_scores,
    prepare_outputs,
    scores_in_options,
    write_outputs,
)
from fpmatch.matching.registry import DEFAULT_MATCHER, matcher_failures, matcher_names
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from pathlib import Path

_STAGES = {
    "extract": "extracting prints",
    "extract probes": "extracting squares",
    "compare": "comparing pairs",
}
_WORKERS_NEED = (
    *(f"PIL.{name}ImagePlugin" for name in ("Bmp", "Gif", "Jpeg", "Png", "Ppm")),
    "cv2",
    "threadpoolctl",
    "fpmatch.prints.reading",
    "fpmatch.lab.evaluation.databases.comparison",
    "fpmatch.lab.evaluation.databases.extraction",
    "fpmatch.image.extract",
    "fpmatch.matching.matchers.unit_circle",
)


@click.command(
    context_settings=old_names(resamples="bootstrap", minutiae="ground-truth"),
    epilog=EPILOG,
)
@places_argument("places", metavar="[DIR|MANIFEST|GALLERY...]", required=False)
@pattern_option
@by_folder_option
@click.option(
    "--protocol",
    type=click.Choice(["extended", "fvc", "identification"]),
    default="extended",
    help="Impostor pairs: all impressions of different fingers, or first impressions only; or "
    "search for each print in a gallery where a third have a mate.",
)
@click.option(
    "--matcher",
    "matchers",
    multiple=True,
    default=[DEFAULT_MATCHER],
    metavar="NAME",
    help="Matcher to evaluate, by its name or its place, package.module:OBJECT, perhaps with "
    "parameters, as in unit-circle:rounds=5; repeatable, or all, to compare several side by side.",
)
@file_option(
    "--pairs",
    metavar="LIST",
    help="Compare these pairs only: columns probe, reference and perhaps genuine (1 or 0).",
)
@enhance_option
@file_option("--scores", metavar="OUT.csv", help="Write every comparison to a CSV file.")
@file_option(
    "--report",
    "report_folder",
    metavar="DIR",
    help="Write index.html there: tables, DET and other curves, and drawings of the hardest pairs.",
)
@file_option(
    "--baseline",
    metavar="SCORES.csv",
    help="Compare pair by pair with an earlier run: the file of its --scores, or of fpmatch score.",
)
@click.option(
    "--bootstrap",
    metavar="N",
    type=FROM_0,
    default=1000,
    help="Bootstrap replicates for the 95 % intervals; 0 for none.",
)
@click.option("--seed", type=FROM_0, default=0, help="Seed of their draws.")
@click.option(
    "--ground-truth",
    is_flag=True,
    help="Measure extraction and transforms (of the first matcher) too, against the true minutiae "
    "in each DIR.",
)
@click.option(
    "--crop",
    metavar="PX",
    type=click.IntRange(min=32, max=4000),
    help="Compare a square of PX by PX pixels at 500 dpi, about the centroid of the first print of "
    "each pair, with the whole second print.",
)
@click.option(
    "--enrol",
    "enrolled",
    metavar="N",
    type=click.IntRange(1, 1000),
    help="Enrol the first N impressions of every finger together, and compare each other "
    "impression with each finger.",
)
@click.option(
    "--enrol-seed", type=FROM_0, help="Draw the N impressions of --enrol at random, by this seed."
)
@click.option(
    "--impostors",
    metavar="DIR",
    multiple=True,
    help="With --enrol: compare the prints of this database, of other fingers, too; repeatable.",
)
@scores_in_options
@identification_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object; rates as fractions.")
@workers_option
@key_option
def evaluate(
    places: tuple[str, ...],
    pattern: str | None,
    by_folder: bool,
    protocol: str,
    matchers: tuple[str, ...],
    pairs: Path | None,
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
    **given: Any,
) -> int:
    """Measure error rates on databases of prints, or of scores that are already there.

    Each DIR contains images or templates named FFF_M.tif (finger FFF, impression M; other formats
    too), or named by --pattern, or in folders, one a finger; it may contain a dataset.toml with
    name, dpi and sensor. A MANIFEST is a CSV file with the columns path and subject, and perhaps
    finger, impression and dpi. The output is the rates per database, of several also their mean and
    those of all scores pooled, and their 95 % intervals. Files of scores take the place of
    databases: those of --scores and of fpmatch score, or tables of another matcher's scores.
    """
    draws: dict[str, Any] = {"bootstrap": bootstrap, "seed": seed}
    files = {"report_folder": report_folder, "curves": curves, "det": det, "table": table}
    search_options = {name: given.pop(name) for name in OPTIONS}
    if protocol != "identification":
        refuse_identification_options(search_options)
    if given["scores_in"] or given["genuine_scores"] or given["impostor_scores"]:
        given |= {"files": files, "pattern": pattern}
        return evaluate_given_scores(baseline, as_json=as_json, fmrs=fmrs, **draws, **given)
    if not places:
        raise click.UsageError("Missing argument 'DIR|MANIFEST|GALLERY...'.")
    if protocol == "identification":
        search_options |= {"pattern": pattern, "by_folder": by_folder, "enhance": enhance, **draws}
        search_options |= {"curves": curves, "det": det, "workers": workers, "as_json": as_json}
        return evaluate_by_searches(places, _chosen(matchers), **search_options)
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
    from fpmatch.gallery.engine.local import start_fork_server

    start_fork_server(workers, *_WORKERS_NEED)
    with fast_imports():
        import numpy.ma  # noqa: F401  (np.median would, when the workers have done)

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
    prepare_outputs(**files)
    earlier = None if baseline is None else read_scores(baseline)
    labels: dict[str, Any] = {"pattern": pattern, "by_folder": by_folder}
    loaded = run.load_datasets(places, protocol, **labels, pairs=pairs)
    datasets = dataset.with_unique_names(loaded)
    plan = None
    if enrolled is not None:
        others = run.load_datasets([*loaded, *impostors], **labels)[len(loaded) :]
        plan = enrolment.Enrolment(enrolled, enrol_seed, tuple(dataset.with_unique_names(others)))
    graded = any(one is not None for one in (scores, report_folder, curves))
    truths = [load_truth(dataset) for dataset in datasets] if ground_truth else []
    say_slow_kernels()
    with processes(workers) as engine, ProgressBars(_STAGES) as bars:
        read = PrintReader(quiet=True)
        reader = extraction.dataset_reader(datasets, read, engine)
        results = run.evaluate_matchers(
            datasets,
            _chosen(matchers),
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
    report = Report.of(results, **draws, fmrs=fmrs, baseline=earlier, baseline_name=str(baseline))
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


def _chosen(names: tuple[str, ...]) -> list[str]:
    """Return the requested matchers, each once; "all" means every matcher that can be loaded."""
    known = matcher_names()
    if "all" in names:
        for name, why in matcher_failures().items():
            known.remove(name)
            say_note(f"matcher {name} is left out: {why}")
    every = [name for given in names for name in (known if given == "all" else [given])]
    return list(dict.fromkeys(every))
