"""`fpmatch evaluate`: error rates on databases of prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.base.plugins import MATCHERS, load_plugins
from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.options import enhance_option, file_option, reading_options
from fpmatch.cli.progress import ProgressBars
from fpmatch.gallery.cli.notes import notes_as_json
from fpmatch.gallery.cli.options import (
    key_option,
    pattern_option,
    places_argument,
    workers_option,
)
from fpmatch.lab.cli.rates import RATES, prepare_outputs, rate_options, write_outputs
from fpmatch.matching.registry import DEFAULT_MATCHER, OWN_MATCHERS, matcher_names
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity

STAGES = {"extract": "extracting prints", "compare": "comparing pairs"}


@click.command(
    cls=Command,
    details=RATES
    + """
The rates of several databases are followed by their mean, and by the rates of all scores pooled.

\b
More examples:
  fpmatch evaluate fvc2002/DB*_B --enhance filters
  fpmatch evaluate scans --pattern '(?P<subject>\\d+)_(?P<finger>[a-z]+)_(?P<impression>\\d)'
  fpmatch evaluate fvc2002/DB1_B --protocol fvc --baseline scores.csv
  fpmatch evaluate fvc2002/DB1_B --fmr 0.0005 --det det.pdf
""",
    epilog="""\b
Examples:
  fpmatch evaluate fvc2002/DB1_B
  fpmatch evaluate fvc2002/DB*_B --matcher all --json
  fpmatch evaluate fvc2002/DB1_B --protocol fvc --scores scores.csv
  fpmatch evaluate sample_data --report report

Exit status: 0 when every image gave a template, 1 when some did not, 2 on bad input.
""",
)
@places_argument("places", metavar="DIR|MANIFEST|GALLERY...")
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
    help="Matcher of fpmatch doctor --matchers; repeatable, or all.",
)
@reading_options
@enhance_option
@file_option("--scores", metavar="OUT.csv", help="Write every comparison to a CSV file.")
@rate_options
@workers_option
@key_option
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
    from fpmatch.base.output import check_writable
    from fpmatch.lab.evaluation import run
    from fpmatch.lab.evaluation.databases.dataset import with_unique_names
    from fpmatch.lab.evaluation.databases.extraction import Reading
    from fpmatch.lab.evaluation.rates.scores import read_scores
    from fpmatch.lab.evaluation.report.results import report_document
    from fpmatch.lab.evaluation.report.text import as_text
    from fpmatch.prints.reading import ASSUMED_DPI, PrintReader

    if scores is not None:
        check_writable(scores)
    outputs = prepare_outputs(options)
    earlier = None if baseline is None else read_scores(baseline)
    loaded = run.load_datasets(places, protocol, pattern=pattern)
    datasets = [one.at(dpi) for one in with_unique_names(loaded)]
    say_slow_kernels()
    reader = PrintReader(raw, quiet=True)
    with ProgressBars(STAGES) as bars:
        results = run.evaluate_matchers(
            datasets,
            _chosen_matchers(matchers),
            protocol=protocol,
            workers=workers,
            progress=bars.show,
            reading=Reading(reader, polarity, enhance, graded=scores is not None),
            scores=scores,
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
    document = report_document(results, **options)
    document |= {"dpi_assumed": len(assumed), "notes": notes_as_json(noted)}
    show(json_text(document) if as_json else as_text(document))
    write_outputs(results, document, outputs)
    return 1 if results[0].failures else 0


def _chosen_matchers(names: tuple[str, ...]) -> list[str]:
    """Return the requested matchers, each once; "all" means every matcher that can be loaded."""
    known = matcher_names()
    if "all" in names:
        for name, why in load_plugins(MATCHERS)[1].items():
            if name not in OWN_MATCHERS:
                known.remove(name)
                say_note(f"matcher {name} is left out: {why}")
    every = [name for given in names for name in (known if given == "all" else [given])]
    return list(dict.fromkeys(every))
