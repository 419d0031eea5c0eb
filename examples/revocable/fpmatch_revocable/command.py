"""`fpmatch revocable`: templates under a key, and their comparison without it (research)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import click

from fpmatch.cli.command import Group
from fpmatch.cli.notes import say_notes, show, show_line
from fpmatch.cli.options import (
    FILE,
    angles_option,
    enhance_option,
    json_option,
    output_option,
    reading_options,
)
from fpmatch.gallery.cli.options import key_option
from fpmatch.printable import json_text, printable

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.formats.angles import AngleConvention
    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity

DEFAULT_FMR: Final = 0.001


@click.group(
    cls=Group,
    epilog="""\b
Examples:
  fpmatch key my.key --new
  fpmatch revocable protect probe.tif -o probe.rev --key file:my.key
  fpmatch revocable compare probe.rev reference.rev
""",
)
def revocable() -> None:
    """Protect templates under a key, and compare them without it (research).

    Templates of different keys have nothing in common, even of one print: to revoke a template,
    take another key. The comparison errs more often than that of minutiae, and whoever has the key
    can compute minutiae from a template; docs/explanation/revocable_templates.md has the figures.
    """


@revocable.command(
    epilog="""\b
Example:
  fpmatch revocable protect probe.tif -o probe.rev --key file:my.key
"""
)
@click.argument("source", metavar="PRINT", type=FILE)
@output_option(metavar="FILE", help="Write the revocable template to this file.")
@key_option
@reading_options
@enhance_option
@angles_option
def protect(
    source: Path,
    output: Path,
    dpi: float | None,
    polarity: Polarity,
    raw: tuple[RawSize, ...],
    enhance: str,
    angles: AngleConvention | None,
) -> None:
    """Write the revocable template of PRINT, an image or a template, under the current key."""
    from fpmatch.base.output import check_writable
    from fpmatch.gallery.encryption.keys import load_keys
    from fpmatch.prints.reading import PrintReader, read_given_print
    from fpmatch_revocable import template

    check_writable(output)
    key = load_keys().current
    reader = PrintReader(raw, quiet=True, angles=angles)
    given = read_given_print(source, reader, polarity=polarity, dpi=dpi, enhance=enhance)
    say_notes({note: [source] for note in given.notes})
    template.protect(given.template, key).save(output)
    show_line(f"{printable(str(output))}: revocable template under key {key.id}")


@revocable.command(
    epilog="""\b
JSON:
  match       whether the score reaches the threshold
  score       -10 log10 of the false match rate, as of fpmatch verify
  fmr         false match rate of this score
  threshold   score that a match needs
  similarity  share of the words in common that pairs of minutiae have, 0 to 1
  key         id of the key of both

\b
Example:
  fpmatch revocable compare probe.rev reference.rev --fmr 0.01

Exit status: 0 match, 1 no match, 2 input that cannot be used.
"""
)
@click.argument("probe", type=FILE)
@click.argument("reference", type=FILE)
@click.option(
    "--fmr",
    type=float,
    metavar="RATE",
    default=DEFAULT_FMR,
    show_default=True,
    help="Decide at this false match rate.",
)
@json_option
def compare(probe: Path, reference: Path, fmr: float, as_json: bool) -> int:
    """Decide whether two revocable templates of one key are of the same finger; needs no key."""
    from fpmatch.matching.calibration import fmr_to_score, load_calibration, score_to_fmr
    from fpmatch.prints.report import odds, score_as_high, verdict
    from fpmatch_revocable import compare as comparison
    from fpmatch_revocable.matcher import CALIBRATION, MATCHER
    from fpmatch_revocable.template import RevocableTemplate

    threshold = fmr_to_score(fmr)
    a, b = RevocableTemplate.load(probe), RevocableTemplate.load(reference)
    similarity = comparison.compare(a, b)
    score = load_calibration(MATCHER.name, CALIBRATION).score(similarity)
    match, rate = score >= threshold, score_to_fmr(score)
    if as_json:
        document = {
            "match": match,
            "score": score,
            "fmr": rate,
            "threshold": threshold,
            "similarity": similarity,
            "key": a.key_id,
        }
        show(json_text(document))
    else:
        needed = f"a match needs {threshold:.1f}"
        show(f"{verdict(match)}\n  Score       {score:.1f} on a scale to 100; {needed}")
        show(f"  FMR         {score_as_high(odds(rate))}")
        show(f"  Similarity  {similarity:.3f}\n  Key         {a.key_id}")
    return 0 if match else 1
