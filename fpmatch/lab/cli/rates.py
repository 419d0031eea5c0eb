"""`fpmatch rates`: error rates of scores that are already there, of any matcher."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, show
from fpmatch.cli.options import add_options, file_option, files_argument
from fpmatch.gallery.cli.options import FROM_0, pattern_option
from fpmatch.lab.cli.columns import RATES
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from fpmatch.lab.evaluation.report.analysis import Report

_OPTIONS: Final = (
    click.option(
        "--fmr",
        "fmrs",
        metavar="RATE",
        type=click.FloatRange(0, 1, min_open=True, max_open=True),
        multiple=True,
        help="Report the FNMR at this false match rate, with its interval; repeatable.",
    ),
    file_option(
        "--report",
        "report_folder",
        metavar="DIR",
        help="Write a page there: tables, DET, distributions of scores, the hardest pairs.",
    ),
    file_option(
        "--baseline",
        metavar="SCORES.csv",
        help="Compare pair by pair with an earlier run: the file of its --scores, or of fpmatch "
        "score.",
    ),
    file_option(
        "--curves",
        metavar="DIR",
        hidden=True,
        help="Write the points of the DET curves there, as det.csv.",
    ),
    file_option("--det", metavar="FILE", help="Draw the DET curves into a .pdf, .svg or .png."),
    file_option(
        "--table", metavar="FILE", help="Write the table of rates as .tex (LaTeX) or .csv."
    ),
    click.option(
        "--bootstrap",
        metavar="N",
        type=FROM_0,
        default=1000,
        hidden=True,
        help="Bootstrap replicates for the 95 % intervals; 0 for none.",
    ),
    click.option("--seed", type=FROM_0, default=0, hidden=True, help="Seed of their draws."),
    click.option(
        "--json", "as_json", is_flag=True, help="Print one JSON object; rates as fractions."
    ),
)


def rate_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options about what is made of scores."""
    return add_options(command, _OPTIONS)


@click.command(
    cls=Command,
    details=RATES,
    epilog="""\b
Examples:
  fpmatch rates scores.csv
  fpmatch rates scores.csv theirs.csv --report report
  fpmatch rates theirs.csv --distances --fmr 0.0001 --det det.pdf --table rates.tex
  fpmatch rates --genuine-scores genuine.txt --impostor-scores impostor.txt

Exit status: 0 when the rates are printed, 2 when the scores cannot be used.
""",
)
@files_argument("scores", metavar="[SCORES]...", required=False)
@file_option(
    "--genuine-scores",
    metavar="FILE",
    multiple=True,
    help="A file of genuine scores alone, in place of SCORES; needs --impostor-scores.",
)
@file_option(
    "--impostor-scores", metavar="FILE", multiple=True, help="Impostor scores of that matcher."
)
@click.option("--distances", is_flag=True, help="The scores are distances: lower is more similar.")
@pattern_option
@rate_options
def rates(
    scores: tuple[Path, ...],
    genuine_scores: tuple[Path, ...],
    impostor_scores: tuple[Path, ...],
    distances: bool,
    pattern: str | None,
    baseline: Path | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Compute error rates of the SCORES of fpmatch or of any other matcher.

    SCORES are files of fpmatch evaluate --scores or fpmatch score, or tables of another matcher
    whose first line names the columns: probe, reference, similarity or score, perhaps genuine (1 or
    0). Several files are compared side by side.
    """
    if not (scores or genuine_scores or impostor_scores):
        raise click.UsageError("Missing argument 'SCORES...'.")
    if len(genuine_scores) != len(impostor_scores):
        raise click.UsageError("--genuine-scores and --impostor-scores go together")
    from fpmatch.lab.evaluation.rates.scores import finger_in_name, read_scores
    from fpmatch.lab.evaluation.report.analysis import Report
    from fpmatch.lab.evaluation.report.results import evaluate_scores, notes_on
    from fpmatch.lab.evaluation.report.text import as_text

    files = prepare_outputs(options)
    of_name = finger_in_name(pattern)
    earlier = None
    if baseline is not None:
        how: dict[str, Any] = {"finger_of": lambda _, name: of_name(name)}
        earlier = read_scores(baseline, distances=distances, **how)
    pairs = list(zip(genuine_scores, impostor_scores, strict=True))
    results = evaluate_scores(
        scores, genuine_and_impostor=pairs, distances=distances, pattern=pattern
    )
    noted = [(one.matcher, note) for one in results for note in notes_on(one)]
    for matcher, note in noted:
        say_note(f"{matcher}: {note}")
    report = Report.of(results, **options, baseline=earlier, baseline_name=str(baseline))
    document = report.as_json()
    document["notes"] = [{"note": note, "matcher": matcher} for matcher, note in noted]
    show(json_text(document) if as_json else as_text(report))
    write_outputs(report, files)


def prepare_outputs(options: dict[str, Any]) -> dict[str, Path | None]:
    """Take the files to write out of the options; OutputError where one cannot be written."""
    files = {name: options.pop(name) for name in ("report_folder", "curves", "det", "table")}
    if any(files.values()):
        from fpmatch.lab.evaluation.report.page import prepare_page
        from fpmatch.lab.evaluation.report.tables import check_table, prepare_curves
        from fpmatch.lab.plots.style import check_plot

        checks = prepare_page, prepare_curves, check_plot, check_table
        for file, check in zip(files.values(), checks, strict=True):
            if file is not None:
                check(file)
    return files


def write_outputs(report: Report, files: dict[str, Path | None]) -> None:
    """Write page, curves, DET and table, where requested, and note where they are."""
    reports = [one.report for one in report.analyses]
    if (det := files["det"]) is not None:
        from fpmatch.lab.evaluation.report.figures import save_det

        save_det(det, reports)
        say_note(f"DET: {det}")
    if (table := files["table"]) is not None:
        from fpmatch.lab.evaluation.report.tables import save_table

        save_table(table, report.analyses)
        say_note(f"table: {table}")
    if (folder := files["report_folder"]) is not None:
        from fpmatch.lab.evaluation.report.page import write_page

        say_note(f"report: {write_page(folder, report)}")
    if (curves := files["curves"]) is not None:
        from fpmatch.lab.evaluation.report.tables import write_curves

        say_note(f"curves: {write_curves(curves, reports)}")
