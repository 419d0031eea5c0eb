"""`fpmatch overlay`: a picture of two prints, one over the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, say_notes_on, show_line
from fpmatch.cli.options import output_option
from fpmatch.cli.pair import compare_files, pair_options, save_view, view_options

if TYPE_CHECKING:
    from pathlib import Path


@click.command(
    cls=Command,
    details="""
With --view ridges, the picture shows how well the ridges of both prints agree, on the cells that
the score compared. With --warp, the probe is bent on the mesh of the pairs, as the matcher does to
compare the ridges; what is seen there must be measured in the picture without it. The picture
contains which of the two it is.
""",
    epilog="""\b
Examples:
  fpmatch overlay probe.tif reference.tif -o overlay.png
  fpmatch overlay probe.tif reference.tif -o pairs.svg --view side-by-side
  fpmatch overlay probe.tif reference.tif -o ridges.png --view ridges
  fpmatch overlay probe.tif reference.tif -o warped.png --warp

Exit status: 0 when the picture is written, whatever the decision; 2 on bad input.
""",
)
@pair_options()
@output_option(metavar="OUT.png|.svg", help="Where to write the picture.")
@view_options
def overlay(output: Path, view: str | None, warp: bool, **values: Any) -> None:
    """Draw PROBE, moved by the recovered transform, over REFERENCE.

    The picture shows where ridges agree, the paired minutiae with their directions, the unpaired
    ones fainter, and the decision. Of a template, the minutiae are drawn on white. Where no
    transform is found, the prints are drawn beside each other.
    """
    from fpmatch.prints.report import IDENTITY
    from fpmatch.prints.words import outcome

    pair = compare_files(values)
    say_notes_on((pair.probe, pair.reference))
    if pair.identical is not None:
        say_note(IDENTITY[pair.identical])
    save_view(output, pair, view, warp=warp)
    verification = pair.verification
    show_line(f"{outcome(verification)}, score {verification.score:.1f}: {output}")
