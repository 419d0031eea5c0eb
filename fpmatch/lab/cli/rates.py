"""`fpmatch rates`: error rates of scores that are already there, of any matcher."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, show
from fpmatch.cli.options import add_options, file_option, files_argument
from fpmatch.gallery.cli.options import FROM_0, pattern_option
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.lab.evaluation.report.results import RatesReport

_RATE: Final = click.FloatRange(0, 1, min_open=True, max_open=True)
RATES: Final = """\b
Columns:
  EER       equal error rate
  FMR100    false non-match rate where one impostor in 100 matches
  FMR1000   the same for one in 1,000
  FMR10000  the same for one in 10,000, where the pairs allow it
  ZeroFMR   the same where none matches
  ZeroFNMR  false match rate where no genuine pair is rejected
  d'        decidability: the distance of the means of genuine and impostor scores in units of
            their mean standard deviation
  failed    prints without a template (failures to extract); they have the lowest score in all
            their pairs

\b
The 95 % intervals come from the bootstrap over the fingers of each database: how far the rates
would scatter with other fingers. A rate of 0 or 100 % has one limit, by Clopper and Pearson: "at
most 25.89 % (0 of 10)". ZeroFMR and ZeroFNMR, which depend on one score, have no interval. The
rates of several databases are followed by their mean, and by the rates of all scores pooled.
"""

rate_options: Final = partial(
    add_options,
    options=(
        click.option(
            "--fmr",
            "fmrs",
            metavar="RATE",
            type=_RATE,
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
            help="Compare pair by pair with an earlier run, by its file of scores.",
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
        click.option(
            "--json", "as_json", is_flag=True, help="Print one JSON object; rates as fractions."
        ),
    ),
)


@click.command(
    cls=Command,
    details=RATES,
    epilog="""\b
Examples:
  fpmatch rates scores.csv
  fpmatch rates scores.csv theirs.csv --report report
  fpmatch rates theirs.csv --distances --fmr 0.0001 --det det.pdf --table rates.tex
  fpmatch rates --genuine-scores genuine.txt --impostor-scores impostor.txt
  fpmatch rates candidates.csv --enrolled prints.db

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
@click.option(
    "--enrolled",
    metavar="GALLERY|DIR|FILE",
    help="The SCORES are candidates of searches (fpmatch identify -o) among these subjects.",
)
@click.option(
    "--fpir",
    "fpirs",
    metavar="RATE",
    type=_RATE,
    multiple=True,
    help="With --enrolled: report the FNIR at this FPIR; repeatable.  [default: 0.001, 0.01, 0.1]",
)
@click.option("--distances", is_flag=True, help="The scores are distances: lower is more similar.")
@pattern_option
@rate_options
def rates(
    scores: tuple[Path, ...],
    genuine_scores: tuple[Path, ...],
    impostor_scores: tuple[Path, ...],
    enrolled: str | None,
    fpirs: tuple[float, ...],
    distances: bool,
    pattern: str | None,
    baseline: Path | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Compute error rates of the SCORES of fpmatch or of any other matcher.

    SCORES are files of fpmatch evaluate --scores or fpmatch score, or tables of another matcher
    whose first line names the columns: probe, reference, similarity or score, perhaps genuine (1 or
    0). Several files are compared side by side. With --enrolled they are candidate lists: columns
    probe, subject and score.
    """
    if enrolled is not None:
        of_scores = [options[name] for name in ("fmrs", "report_folder", "table")]
        if not scores or any([genuine_scores, impostor_scores, distances, baseline, *of_scores]):
            raise click.UsageError("--enrolled goes with SCORES, --fpir, --pattern, --det, --json")
        how = {"pattern": pattern, "fpirs": fpirs, "bootstrap": options["bootstrap"]}
        _rates_of_searches(scores, enrolled, options["det"], as_json=as_json, **how)
        return
    if fpirs:
        raise click.UsageError("--fpir goes with --enrolled")
    if not (scores or genuine_scores or impostor_scores):
        raise click.UsageError("Missing argument 'SCORES...'.")
    if len(genuine_scores) != len(impostor_scores):
        raise click.UsageError("--genuine-scores and --impostor-scores go together")
    from fpmatch.lab.evaluation.rates.scores import finger_in_name, read_scores
    from fpmatch.lab.evaluation.run import evaluate_scores, notes_on

    check_outputs(**options)
    earlier = None
    if baseline is not None:
        how = {"distances": distances, "finger_of": finger_in_name(pattern)}
        earlier = read_scores(baseline, **how)
    pairs = list(zip(genuine_scores, impostor_scores, strict=True))
    results = evaluate_scores(
        scores, genuine_and_impostor=pairs, distances=distances, pattern=pattern
    )
    noted = [(one.matcher, note) for one in results for note in notes_on(one)]
    for matcher, note in noted:
        say_note(f"{matcher}: {note}")
    options |= {"baseline": earlier, "baseline_name": str(baseline)}
    notes = [{"note": note, "matcher": matcher} for matcher, note in noted]
    show_rates(results, {"notes": notes}, as_json=as_json, **options)


def _rates_of_searches(
    files: tuple[Path, ...], enrolled: str, det: Path | None, *, as_json: bool, **how: Any
) -> None:
    """Print the error rates of files of candidates, and draw their DET where requested."""
    from fpmatch.lab.evaluation import identification as searches
    from fpmatch.lab.plots.style import check_plot

    if det is not None:
        check_plot(det)
    document = searches.evaluate_candidates(files, enrolled, **how)
    show(json_text(document) if as_json else searches.identification_text(document))
    if det is not None:
        searches.save_identification_det(det, document)
        say_note(f"DET: {det}")


def check_outputs(
    *, det: Path | None, table: Path | None, report_folder: Path | None, **_: Any
) -> None:
    """Raise an OutputError where a requested file cannot be written, before hours of work."""
    if det is not None or table is not None or report_folder is not None:
        from fpmatch.lab.evaluation.report.page import prepare_page
        from fpmatch.lab.evaluation.report.text import check_table
        from fpmatch.lab.plots.style import check_plot

        for path, check in ((det, check_plot), (table, check_table), (report_folder, prepare_page)):
            if path is not None:
                check(path)


def show_rates(
    results: list[RatesReport],
    beside: dict[str, Any],
    *,
    as_json: bool,
    det: Path | None,
    table: Path | None,
    report_folder: Path | None,
    **how: Any,
) -> None:
    """Print the rates, with what is known `beside` them; write DET, table, and page if requested.

    `how` is as for `report_document`.
    """
    from fpmatch.lab.evaluation.report.results import report_document
    from fpmatch.lab.evaluation.report.text import as_text, save_table

    for one in results:
        for kind in [kind for kind in ("genuine", "impostor") if not getattr(one, kind)]:
            say_note(f"{one.matcher}: no {kind} pairs, by which rates are measured")
    document = report_document(results, **how) | beside
    show(json_text(document) if as_json else as_text(document))
    if det is not None:
        from fpmatch.lab.evaluation.report.figures import save_det

        save_det(det, results)
        say_note(f"DET: {det}")
    if table is not None:
        save_table(table, document)
        say_note(f"table: {table}")
    if report_folder is not None:
        from fpmatch.lab.evaluation.report.page import PAGE_NAME, write_page

        write_page(report_folder / PAGE_NAME, results, document)
        say_note(f"report: {report_folder / PAGE_NAME}")
