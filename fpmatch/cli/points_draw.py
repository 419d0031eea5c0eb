"""`fpmatch points draw`: the paper's figures, from a point set of one's own or a random one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from fpmatch.drawing.paper_figures.pair import PointPair
    from fpmatch.drawing.paper_figures.sheet import FileFormat


@click.command(
    "draw",
    epilog="""\b
Pictures:
  figure_2_triangulations   the sets and their Delaunay triangulations
  figure_3_one_rings        one-rings that correspond
  figure_4_unit_circle      a one-ring on the unit circle, its sectors and weights
  figure_5_weights          how the weights come about
  figure_6a_two_circles     the unit circles of two rings that correspond
  figure_6b_rotation        their rotation, and P laid on Q by it

\b
Examples:
  fpmatch points draw -o figures
  fpmatch points draw stars.csv -o figures --format png
  fpmatch points draw stars.csv catalogue.csv -o figures --ring 12
""",
)
@click.argument("p", metavar="[P.csv]", required=False, type=click.Path(path_type=Path))
@click.argument("q", metavar="[Q.csv]", required=False, type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    metavar="FOLDER",
    required=True,
    type=click.Path(path_type=Path),
    help="Folder for the pictures; made if missing.",
)
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["svg", "png"]),
    default="svg",
    show_default=True,
    help="SVG is 800 pixels wide, PNG 1600.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    help="Makes the random sets, or the rotation of Q.  [default: one that is easy to read]",
)
@click.option(
    "--ring",
    type=click.IntRange(min=0),
    metavar="ROW",
    help="Centre of the one-ring to show: a row of P, from 0.  "
    "[default: one of 5 to 7 points that is easy to read]",
)
@click.option(
    "--json", "as_json", is_flag=True, help="Print the numbers drawn, as one JSON object."
)
def points_draw(
    p: Path | None,
    q: Path | None,
    output: Path,
    file_format: FileFormat,
    seed: int | None,
    ring: int | None,
    as_json: bool,
) -> None:
    """Draw Figures 2 to 6 of the paper for the sets P and Q.

    Without files, P is random, and Q is P rotated, scaled and jittered. With one, Q is P rotated.
    With two, `fpmatch points match` says which points are partners. In the pictures x points to
    the right and y up; angles are counter-clockwise. Needs matplotlib (the extra "plot").
    """
    from fpmatch.drawing.paper_figures.choice import choose_ring_pair
    from fpmatch.drawing.paper_figures.figures import (
        draw_point_figures,
        numbers_drawn,
        write_point_figures,
    )

    pair = _pair(p, q, seed)
    rings = choose_ring_pair(pair, ring)
    figures = draw_point_figures(pair, rings, file_format)
    files = write_point_figures(figures, output)
    numbers = numbers_drawn(pair, rings)
    if as_json:
        click.echo(json.dumps({"files": list(map(str, files)), **numbers}, indent=2))
        return
    for file, figure in zip(files, figures, strict=True):
        click.echo(f"{file}: {figure.title}")
    click.echo(
        f"Ring of point {rings.p.centre} of P ({len(rings.p)} points), partner: point "
        f"{rings.q.centre} of Q; {numbers['matched']} of {numbers['points']['p']} points match"
    )


def _pair(p: Path | None, q: Path | None, seed: int | None) -> PointPair:
    """Return the sets that the files, or their absence, ask for."""
    from fpmatch.drawing.paper_figures.pair import (
        EASY_SEED,
        matched_point_pair,
        random_point_pair,
        rotated_point_pair,
    )
    from fpmatch.formats.points_csv import load_points

    chosen = EASY_SEED if seed is None else seed
    if p is None:
        return random_point_pair(chosen)
    if q is None:
        return rotated_point_pair(load_points(p), str(p), chosen)
    if seed is not None:
        raise click.UsageError("--seed has no use where both sets are given")
    return matched_point_pair(load_points(p), load_points(q), str(p), str(q))
