"""`fpmatch rates`: error rates of scores that are already there, of any matcher."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, show
from fpmatch.cli.options import add_options, file_option, files_argument
from fpmatch.gallery.cli.options import FROM_0, pattern_option
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from fpmatch.lab.evaluation.report.results import RatesReport

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
would scatter with other fingers. A rate of 0 or 100 % has one limit, for which each finger is one
trial: "at most 25.89 % (0 of 10)", 95 %, one-sided, by Clopper and Pearson; about 3 / n (rule of
3). For the EER a trial is a pair of fingers, each finger in one pair. ZeroFMR and ZeroFNMR, which
depend on one score, have no interval.
"""

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
    type=click.FloatRange(0, 1, min_open=True, max_open=True),
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
        others = genuine_scores or impostor_scores or distances or baseline or options.pop("fmrs")
        others = any(options.pop(name) for name in ("report_folder", "table")) or others
        if others or not scores:
            raise click.UsageError("--enrolled goes with SCORES, --fpir, --pattern, --det, --json")
        _rates_of_searches(scores, enrolled, pattern, fpirs, as_json, **options)
        return
    if fpirs:
        raise click.UsageError("--fpir goes with --enrolled")
    if not (scores or genuine_scores or impostor_scores):
        raise click.UsageError("Missing argument 'SCORES...'.")
    if len(genuine_scores) != len(impostor_scores):
        raise click.UsageError("--genuine-scores and --impostor-scores go together")
    from fpmatch.lab.evaluation.rates.scores import finger_in_name, read_scores
    from fpmatch.lab.evaluation.report.results import report_document
    from fpmatch.lab.evaluation.report.text import as_text
    from fpmatch.lab.evaluation.run import evaluate_scores, notes_on

    outputs = prepare_outputs(options)
    of_name = finger_in_name(pattern)
    earlier = None
    if baseline is not None:
        earlier = read_scores(baseline, distances=distances, finger_of=of_name)
    pairs = list(zip(genuine_scores, impostor_scores, strict=True))
    results = evaluate_scores(
        scores, genuine_and_impostor=pairs, distances=distances, pattern=pattern
    )
    noted = [(one.matcher, note) for one in results for note in notes_on(one)]
    for matcher, note in noted:
        say_note(f"{matcher}: {note}")
    options |= {"baseline": earlier, "baseline_name": str(baseline)}
    document = report_document(results, **options)
    document["notes"] = [{"note": note, "matcher": matcher} for matcher, note in noted]
    show(json_text(document) if as_json else as_text(document))
    write_outputs(results, document, outputs)


def _rates_of_searches(
    files: tuple[Path, ...],
    enrolled: str,
    pattern: str | None,
    fpirs: tuple[float, ...],
    as_json: bool,
    *,
    det: Path | None,
    bootstrap: int,
    seed: int,
) -> None:
    """Print the error rates of files of candidates, and draw their DET where requested."""
    from fpmatch.lab.evaluation import identification as searches
    from fpmatch.lab.plots.style import check_plot

    if det is not None:
        check_plot(det)
    document = searches.evaluate_candidates(
        files, enrolled, pattern=pattern, fpirs=fpirs, bootstrap=bootstrap, seed=seed
    )
    show(json_text(document) if as_json else searches.identification_text(document))
    if det is not None:
        searches.save_identification_det(det, document)
        say_note(f"DET: {det}")


def prepare_outputs(options: dict[str, Any]) -> list[tuple[str, Path, Callable[..., Any]]]:
    """Take the files to write out of the options: what each is, its path, and what writes it.

    Raises an OutputError where one cannot be written.
    """
    given = {name: options.pop(name) for name in ("det", "table", "report_folder")}
    if not any(given.values()):
        return []
    from fpmatch.lab.evaluation.report.figures import save_det
    from fpmatch.lab.evaluation.report.page import prepare_page, write_page
    from fpmatch.lab.evaluation.report.text import check_table, save_table
    from fpmatch.lab.plots.style import check_plot

    kinds = (
        ("DET", check_plot, lambda path, results, _: save_det(path, results)),
        ("table", check_table, lambda path, _, document: save_table(path, document)),
        ("report", prepare_page, write_page),
    )
    return [
        (kind, check(path) or path, write)
        for path, (kind, check, write) in zip(given.values(), kinds, strict=True)
        if path is not None
    ]


def write_outputs(
    results: list[RatesReport],
    document: dict[str, Any],
    outputs: list[tuple[str, Path, Callable[..., Any]]],
) -> None:
    """Write page, DET and table, where requested, and note where they are."""
    for kind, path, write in outputs:
        write(path, results, document)
        say_note(f"{kind}: {path}")
