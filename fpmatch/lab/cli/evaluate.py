"""`fpmatch evaluate`: error rates on databases of prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, say_notes, say_slow_kernels
from fpmatch.cli.options import enhance_option, file_option, reading_options
from fpmatch.cli.progress import ProgressBars
from fpmatch.gallery.cli.notes import notes_as_json
from fpmatch.gallery.cli.options import pattern_option, places_argument, workers_option
from fpmatch.lab.cli.rates import RATES, check_outputs, rate_options, show_rates
from fpmatch.matching.registry import DEFAULT_MATCHER

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity

STAGES = {"extract": "extracting prints", "compare": "comparing pairs"}


@click.command(
    cls=Command,
    details=RATES,
    epilog="""\b
Examples:
  fpmatch evaluate fvc2002/DB1_B
  fpmatch evaluate fvc2002/DB*_B --matcher unit-circle --matcher paper --json
  fpmatch evaluate fvc2002/DB1_B --protocol fvc --scores scores.csv
  fpmatch evaluate fvc2002/DB1_B --protocol fvc --baseline scores.csv
  fpmatch evaluate sample_data --report report

Exit status: 0 when every image gave a template, 1 when some did not, 2 on bad input.
""",
)
@places_argument("places", metavar="DIR|MANIFEST...")
@pattern_option
@click.option(
    "--protocol",
    type=click.Choice(["extended", "fvc"]),
    default="extended",
    help="Impostor pairs: all impressions of different fingers, or first impressions only.",
)
@click.option(
    "--matcher",
    "matchers",
    multiple=True,
    default=[DEFAULT_MATCHER],
    metavar="NAME",
    help="Matcher of fpmatch doctor --matchers; repeatable.",
)
@reading_options
@enhance_option
@file_option("--scores", metavar="OUT.csv", help="Write every comparison to a CSV file.")
@rate_options
@workers_option
def evaluate(
    places: tuple[str, ...],
    pattern: str | None,
    protocol: str,
    matchers: tuple[str, ...],
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    enhance: str,
    scores: Path | None,
    baseline: Path | None,
    as_json: bool,
    workers: int | None,
    **options: Any,
) -> int:
    """Measure error rates on databases of prints.

    Each DIR contains images or templates named FFF_M.tif (finger FFF, impression M), or named by
    --pattern, or in folders, one a finger; perhaps a dataset.toml with name, dpi and sensor. A
    MANIFEST is as for fpmatch enrol. With --scores an interrupted run is resumed by the same
    command.
    """
    from fpmatch.lab.evaluation import run
    from fpmatch.lab.evaluation.rates.scores import read_scores
    from fpmatch.prints.reading import ASSUMED_DPI, PrintReader

    check_outputs(**options)
    earlier = None if baseline is None else read_scores(baseline)
    datasets = run.load_datasets(places, pattern=pattern, dpi=dpi)
    say_slow_kernels()
    with ProgressBars(STAGES) as bars:
        results = run.evaluate_matchers(
            datasets,
            list(dict.fromkeys(matchers)),
            protocol=protocol,
            workers=workers,
            progress=bars.show,
            scores=scores,
            reader=PrintReader(raw, quiet=True),
            polarity=polarity,
            enhance=enhance,
            graded=scores is not None,
        )
    about = [row.about for row in results[0].sets]
    assumed = [one for each in about for one in each["dpi_assumed"]]
    noted = {note: (one.place,) for one in datasets for note in one.notes}
    for each in about:
        for note, names in each["noted"].items():
            noted[note] = (*noted.get(note, ()), *names)
    say_notes({ASSUMED_DPI: assumed, **noted} if assumed else noted)
    for name, reason in results[0].failures:
        say_note(f"no template: {name}: {reason}")
    options |= {"baseline": earlier, "baseline_name": str(baseline)}
    beside = {"dpi_assumed": len(assumed), "notes": notes_as_json(noted)}
    show_rates(results, beside, as_json=as_json, **options)
    return 1 if results[0].failures else 0
