"""`fpmatch evaluate --scores-in`: error rates of scores that are already there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.notes import say_note, show
from fpmatch.cli.options import file_option, old_option
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence
    from pathlib import Path

    from fpmatch.lab.evaluation.report.analysis import Report

_GO_WITH_SCORES: Final = frozenset(
    {"scores_in", "genuine_scores", "impostor_scores", "distances", "report_folder", "curves"}
    | {"det", "table"}
    | {"baseline", "bootstrap", "seed", "fmrs", "as_json", "workers", "pattern"}
)
_OPTIONS: Final = (
    file_option(
        "--scores-in",
        metavar="FILE",
        multiple=True,
        help="Evaluate the scores in a file, of fpmatch or of any other matcher, instead of DIR; "
        "repeatable, to compare several matchers.",
    ),
    file_option(
        "--genuine-scores",
        metavar="FILE",
        multiple=True,
        help="The same with a file of genuine scores alone; needs --impostor-scores.",
    ),
    file_option(
        "--impostor-scores", metavar="FILE", multiple=True, help="Impostor scores of that matcher."
    ),
    click.option(
        "--distances", is_flag=True, help="Their scores are distances: lower is more similar."
    ),
    click.option(
        "--fmr",
        "fmrs",
        metavar="RATE",
        type=click.FloatRange(0, 1, min_open=True, max_open=True),
        multiple=True,
        help="Report the FNMR at this false match rate, with its interval; repeatable.",
    ),
    file_option(
        "--curves",
        metavar="DIR",
        help="Write the points of the curves there: det.csv, histogram.csv, discard.csv.",
    ),
    file_option(
        "--det",
        metavar="FILE",
        help="Draw the DET curves into a .pdf, .svg or .png; with --protocol identification FNIR "
        "against FPIR and rank.",
    ),
    old_option("--plot", "--det {}"),
    file_option(
        "--table",
        metavar="FILE",
        help="Write the table of rates of all matchers and databases as .tex (LaTeX) or .csv.",
    ),
)


def add_options(command: Callable[..., Any], options: Sequence[Any]) -> Callable[..., Any]:
    """Add options to a command, in their order."""
    for option in reversed(options):
        command = option(command)
    return command


def scores_in_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of scores that are already there, and of what is made of scores."""
    return add_options(command, _OPTIONS)


def evaluate_given_scores(
    baseline: Path | None,
    *,
    files: Mapping[str, Path | None],
    pattern: str | None,
    scores_in: Sequence[Path],
    genuine_scores: Sequence[Path],
    impostor_scores: Sequence[Path],
    distances: bool,
    as_json: bool,
    **draws: Any,
) -> int:
    """Run the command with scores that are already there; `draws` are for `Report.of`."""
    refuse_others(_GO_WITH_SCORES, "scores that are already there go without {}")
    if len(genuine_scores) != len(impostor_scores):
        raise click.UsageError("--genuine-scores and --impostor-scores go together")
    from fpmatch.lab.evaluation.rates.scores import read_scores
    from fpmatch.lab.evaluation.report.analysis import Report
    from fpmatch.lab.evaluation.report.score_reports import (
        evaluate_scores,
        finger_in_name,
        notes_on,
    )

    prepare_outputs(**files)
    how: dict[str, Any] = {"distances": distances, "finger_of": finger_in_name(pattern)}
    earlier = None if baseline is None else read_scores(baseline, **how)
    pairs = list(zip(genuine_scores, impostor_scores, strict=True))
    results = evaluate_scores(
        scores_in, genuine_and_impostor=pairs, distances=distances, pattern=pattern
    )
    noted = {one.matcher: notes_on(one) for one in results}
    for matcher, notes in noted.items():
        for note in notes:
            say_note(f"{matcher}: {note}")
    report = Report.of(results, **draws, baseline=earlier, baseline_name=str(baseline))
    write_outputs(report, **files)
    document = report.as_json()
    document["notes"] = [
        {"note": note, "matcher": matcher} for matcher, notes in noted.items() for note in notes
    ]
    show(json_text(document) if as_json else report.as_text())
    return 0


def prepare_outputs(
    report_folder: Path | None, curves: Path | None, det: Path | None, table: Path | None
) -> None:
    """Raise an OutputError if the report, curves, DET or table cannot be written."""
    if det is not None or table is not None:
        from fpmatch.lab.evaluation.report.papers import prepare_files

        prepare_files(det, table)
    if report_folder is not None:
        from fpmatch.lab.evaluation.report.page import prepare_page

        prepare_page(report_folder)
    if curves is not None:
        from fpmatch.lab.evaluation.report.curves import prepare_curves

        prepare_curves(curves)


def write_outputs(
    report: Report,
    *,
    report_folder: Path | None,
    curves: Path | None,
    det: Path | None,
    table: Path | None,
) -> None:
    """Write report, curves, DET and table, where requested, and note where they are."""
    if det is not None:
        from fpmatch.lab.evaluation.report.papers import save_det

        save_det(det, [one.report for one in report.analyses])
        say_note(f"DET: {det}")
    if table is not None:
        from fpmatch.lab.evaluation.report.papers import save_table

        save_table(table, report.analyses)
        say_note(f"table: {table}")
    if report_folder is not None:
        from fpmatch.lab.evaluation.report.page import write_page

        say_note(f"report: {write_page(report_folder, report)}")
    if curves is not None:
        from fpmatch.lab.evaluation.report.curves import write_curves

        files = write_curves(curves, report.analyses)
        say_note(f"curves: {', '.join(map(str, files))}")


def refuse_others(allowed: Collection[str], words: str) -> None:
    """Raise a UsageError with these words if a parameter was given that is not allowed."""
    context = click.get_current_context()
    given = click.core.ParameterSource.COMMANDLINE
    for parameter in context.command.params:
        name = parameter.name or ""
        if context.get_parameter_source(name) is given and name not in allowed:
            raise click.UsageError(words.format("DIR" if name == "places" else parameter.opts[0]))
