"""`fpmatch overlay`: a picture of two prints, one over the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.notes import say_notes_on
from fpmatch.cli.options import output_option
from fpmatch.cli.pair import compare_files, pair_options

if TYPE_CHECKING:
    from pathlib import Path


@click.command(
    epilog="""\b
Examples:
  fpmatch overlay probe.tif reference.tif -o overlay.png
  fpmatch overlay probe.tif reference.tif -o pairs.svg --side-by-side

Exit status: 0 when the picture is written, whatever the decision; 2 on bad input.
"""
)
@pair_options()
@output_option(metavar="OUT.png|.svg", help="Where to write the picture.")
@click.option("--side-by-side", is_flag=True, help="Draw the prints beside each other.")
def overlay(output: Path, side_by_side: bool, **values: Any) -> None:
    """Draw PROBE, moved by the recovered transform, over REFERENCE.

    The picture shows where ridges agree, the paired minutiae with their directions, the unpaired
    ones fainter, and the decision. Of a template, the minutiae are drawn on white. Where no
    transform is found, the prints are drawn beside each other.
    """
    from fpmatch.drawing.overlay.draw import save_overlay
    from fpmatch.drawing.words import verdict

    pair = compare_files(values)
    say_notes_on((pair.probe, pair.reference))
    verification, pixels = pair.verification, (pair.probe.pixels, pair.reference.pixels)
    save_overlay(output, *pixels, verification, side_by_side=side_by_side)
    click.echo(f"{verdict(verification.match)}, score {verification.score:.1f}: {output}")
