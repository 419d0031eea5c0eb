"""`fpmatch points draw`: the paper's figures, from a point set of one's own or a random one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import show, show_line
from fpmatch.cli.options import FILE, output_option
from fpmatch.gallery.cli.options import FROM_0
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.lab.paper_figures.pair import PointPair
    from fpmatch.lab.paper_figures.sheet import FileFormat


@click.command(
    "draw",
    cls=Command,
    epilog="""\b
Pictures:
  figure_2_triangulations   the sets and their Delaunay triangulations
  figure_3_one_rings        one-rings that correspond
  figure_4_unit_circle      a one-ring on the unit circle, its sectors and weights
  figure_5_weights          the computation of the weights
  figure_6a_two_circles     the unit circles of two rings that correspond
  figure_6b_rotation        their rotation, and P aligned with Q by it
  figure_7_flow_chart       the matching algorithm, the same for all sets

\b
Examples:
  fpmatch points draw -o figures
  fpmatch points draw stars.csv -o figures --format png
  fpmatch points draw stars.csv catalogue.csv -o figures --ring 12
  fpmatch points draw negative.csv catalogue.csv -o figures --reflect
  fpmatch points draw minutiae.csv -o figures   # upright, of what fpmatch extract wrote
""",
)
@click.argument("p", metavar="[P.csv]", required=False, type=FILE)
@click.argument("q", metavar="[Q.csv]", required=False, type=FILE)
@output_option(metavar="FOLDER", help="Folder for the pictures; made if missing.")
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["svg", "png"]),
    default="svg",
    help="SVG is 800 pixels wide, PNG 1600.",
)
@click.option(
    "--seed",
    type=FROM_0,
    help="Makes the random sets, or the rotation of Q.  [default: one that is easy to read]",
)
@click.option(
    "--ring",
    type=FROM_0,
    metavar="ROW",
    help="Centre of the one-ring to show: a row of P, from 0.  "
    "[default: one of 5 to 7 points that is easy to read]",
)
@click.option(
    "--y-axis",
    type=click.Choice(["up", "down"]),
    help="Where y of the points points: up as in a plot, or down as in an image.  [default: down "
    "for templates, such as fpmatch extract writes, up for all else]",
)
@click.option(
    "--reflect",
    is_flag=True,
    help="Match mirrored sets too, as fpmatch points match --reflect; P is then drawn mirrored.",
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
    y_axis: Literal["up", "down"] | None,
    reflect: bool,
    as_json: bool,
) -> None:
    """Draw Figures 2 to 7 of the paper for the sets P and Q.

    Without files, P is random, and Q is P rotated, scaled and jittered. With one, Q is P rotated.
    With two, the partners are those of `fpmatch points match`. A file is a CSV of points or a
    template, whose minutiae are drawn as they are in the image. In the pictures x points to the
    right; angles are counter-clockwise. Needs matplotlib (the extra "plot").
    """
    from fpmatch.lab.paper_figures.figures import draw_point_figures, numbers_drawn
    from fpmatch.lab.paper_figures.rings import choose_ring_pair
    from fpmatch.lab.paper_figures.sheet import write_point_figures

    pair = _pair(p, q, seed, y_axis, reflect=reflect)
    rings = choose_ring_pair(pair, ring)
    figures = draw_point_figures(pair, rings, file_format)
    files = write_point_figures(figures, output)
    numbers = numbers_drawn(pair, rings)
    if as_json:
        show(json_text({"files": list(map(str, files)), **numbers}))
        return
    for file, figure in zip(files, figures, strict=True):
        show_line(f"{file}: {figure.title}")
    show(
        f"Ring of point {rings.p.centre} of P ({len(rings.p)} points), partner: point "
        f"{rings.q.centre} of Q; {numbers['matched']} of {numbers['points']['p']} points match"
    )


def _pair(
    p: Path | None,
    q: Path | None,
    seed: int | None,
    y_axis: Literal["up", "down"] | None,
    *,
    reflect: bool,
) -> PointPair:
    """Return the sets that the files, or their absence, ask for."""
    from fpmatch.lab.paper_figures.pair import (
        EASY_SEED,
        matched_point_pair,
        random_point_pair,
        rotated_point_pair,
    )

    if reflect and q is None:
        raise click.UsageError("--reflect has no use unless both sets are given")
    chosen = EASY_SEED if seed is None else seed
    if p is None:
        if y_axis is not None:
            raise click.UsageError("--y-axis has no use where the sets are random")
        return random_point_pair(chosen)
    if q is not None and seed is not None:
        raise click.UsageError("--seed has no use where both sets are given")
    points, of_image = _points(p)
    y_down = of_image if y_axis is None else y_axis == "down"
    if q is None:
        return rotated_point_pair(points, str(p), chosen, y_down=y_down)
    others, both = _points(q)
    if y_axis is None and of_image != both:
        raise click.UsageError("one file is a template, the other is not: --y-axis must be given")
    return matched_point_pair(points, others, str(p), str(q), y_down=y_down, reflect=reflect)


def _points(path: Path) -> tuple[NDArray[np.float64], bool]:
    """Return the points of a file, and whether they are a template's, whose y points down."""
    import numpy as np

    from fpmatch.formats.files import is_template_file, load_template
    from fpmatch.lab.points.points_csv import load_points

    if is_template_file(path):
        return load_template(path).minutiae.xy.astype(np.float64), True
    return load_points(path), False
