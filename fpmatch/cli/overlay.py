"""`fpmatch overlay`: a picture of two prints, one over the other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from fpmatch.cli.pair import PairOptions, compare, pair_options


@click.command(
    epilog="""\b
Examples:
  fpmatch overlay probe.tif reference.tif -o overlay.png
  fpmatch overlay probe.tif reference.tif -o pairs.svg --side-by-side

Exit status: 0 when the picture is written, whatever the decision; 2 on bad input.
"""
)
@pair_options
@click.option(
    "-o",
    "--output",
    metavar="OUT.png|.svg",
    required=True,
    type=click.Path(path_type=Path),
    help="Where to write the picture.",
)
@click.option("--side-by-side", is_flag=True, help="Set the prints beside each other.")
def overlay(output: Path, side_by_side: bool, **values: Any) -> None:
    """Draw PROBE, moved by the recovered transform, over REFERENCE.

    The picture shows where ridges agree, the paired minutiae with their directions, the unpaired
    ones fainter, and the decision in words. A template in place of an image shows its minutiae on
    white. Where no transform is found the prints stand beside
    each other.
    """
    from fpmatch.drawing.overlay.draw import save_overlay
    from fpmatch.drawing.words import verdict

    probe, reference, verification = compare(PairOptions(**values))
    save_overlay(
        output,
        probe.picture(),
        reference.picture(),
        verification,
        side_by_side=side_by_side,
    )
    click.echo(f"{verdict(verification.match)}, score {verification.score:.1f}: {output}")
