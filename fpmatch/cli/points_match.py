"""`fpmatch points match`: the transform between two files of points."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from fpmatch.errors import PointSetError
from fpmatch.pointset.match import POINT_MATCHERS, PointMatcher

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.cli.points_report import NamedPoints

FEWEST_POINTS: Final = 3
STDIN: Final = Path("-")
STDIN_NAME: Final = "standard input"


@click.command(
    "match",
    epilog="""\b
JSON:
  match          whether a transform was found
  transform      scale, rotation_deg, tx, ty, and the 2 x 3 matrix of them; or null
  pairs          [row of P, row of Q] each, counted from 0 without the header
  matched_share  pairs over points of the smaller set
  rms            root mean square distance of the pairs, in the units of Q; or null
  chance         matches as good expected between independent sets; or null
  local_matches  how many local matches the search followed
  reason         why there is no match, where the matcher can tell; else empty
  points         how many points P and Q have
  matcher, tolerance, rho, area_tolerance, p, q: as given; null where not

\b
Matchers:
  triangles      fast, and right where points are missing, moved and strewn among others; matches
                 where so many pairs are not to be expected by chance
  paper          the method of Choi, Lee and Lee; matches where more than a share --rho of the
                 points of the smaller set are paired
  van-wamelen    the paper's baseline; matches where a share --rho of P is paired

\b
Examples:
  fpmatch points match stars.csv catalogue.csv
  fpmatch points match stars.csv catalogue.csv --text --plot match.png
  fpmatch points match spots.csv gel.csv --tolerance 2.5 --pairs pairs.csv
  fpmatch points match stars.csv catalogue.csv --matcher paper --rho 0.9
  cut -f 2,3 stars.tsv | fpmatch points match - catalogue.csv

Exit status: 0 match, 1 no match, 2 could not decide (bad input).
""",
)
@click.argument("p", metavar="P.csv", type=click.Path(path_type=Path, allow_dash=True))
@click.argument("q", metavar="Q.csv", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "--matcher",
    type=click.Choice(POINT_MATCHERS),
    default="triangles",
    show_default=True,
    help="Matcher to use; the others are there to compare with.",
)
@click.option(
    "--tolerance",
    type=float,
    metavar="T",
    help="How far a partner may lie from its place, in the units of Q.  "
    "[default: a share of Q's mean spacing]",
)
@click.option(
    "--rho",
    type=float,
    metavar="SHARE",
    help="Share of the points that must be paired, of matchers paper (more than it) and "
    "van-wamelen.  [default: 0.6, the least of the paper's experiments]",
)
@click.option(
    "--area-tolerance",
    type=float,
    metavar="AREA",
    help="Matcher paper: largest difference between the areas of similar rings on the unit circle; "
    "the paper gives no value.  [default: 0.1]",
)
@click.option(
    "--json/--text", "json_wanted", default=True, help="One JSON object (default), or text."
)
@click.option(
    "--plot",
    metavar="OUT.png|.svg",
    type=click.Path(path_type=Path),
    help="Draw P, moved by the transform, on Q.",
)
@click.option(
    "--pairs",
    metavar="OUT.csv",
    type=click.Path(path_type=Path),
    help="Write a row a pair: its rows in P and Q, both points, their distance.",
)
@click.pass_context
def points_match(
    ctx: click.Context,
    /,
    p: Path,
    q: Path,
    matcher: PointMatcher,
    tolerance: float | None,
    rho: float | None,
    area_tolerance: float | None,
    json_wanted: bool,
    plot: Path | None,
    pairs: Path | None,
) -> None:
    """Find the scale, rotation and shift that lay the points of P.csv on points of Q.csv.

    Both are tables with columns x and y, among others, or two columns of numbers without a
    header; separated by comma, semicolon or tab. A dash (-) reads standard input. Not every point
    needs a partner. The rotation counts from the x axis towards the y axis.
    """
    from fpmatch.cli.points_report import as_json, as_text, write_pairs
    from fpmatch.drawing.plots.point_plot import check_plot, save_point_plot
    from fpmatch.output import check_writable
    from fpmatch.pointset.match import match_points

    if p == q == STDIN:
        raise click.UsageError("only one of the sets can come from standard input")
    if plot is not None:
        check_plot(plot)
    if pairs is not None:
        check_writable(pairs)
    ours, theirs = _read(p), _read(q)
    given = {"tolerance": tolerance, "rho": rho, "area_tolerance": area_tolerance}
    match = match_points(ours.points, theirs.points, matcher=matcher, **given)
    if pairs is not None:
        write_pairs(pairs, ours, theirs, match)
    if plot is not None:
        names = ours.name, theirs.name
        save_point_plot(plot, ours.points, theirs.points, match, names=names)
    click.echo(
        as_json(ours, theirs, match, matcher=matcher, parameters=given)
        if json_wanted
        else as_text(ours, theirs, match)
    )
    ctx.exit(0 if match.transform is not None else 1)


def _read(path: Path) -> NamedPoints:
    """Return points that can be matched; say where some of them coincide."""
    import numpy as np

    from fpmatch.cli.points_report import NamedPoints
    from fpmatch.pointset.points_csv import MAX_BYTES, decode_points, load_points

    if path != STDIN:
        name, points = " ".join(click.format_filename(path).split()), load_points(path)
    elif sys.stdin is not None:
        name, points = STDIN_NAME, decode_points(sys.stdin.buffer.read(MAX_BYTES + 1), STDIN_NAME)
    else:
        raise PointSetError(f"{STDIN_NAME}: is closed")
    if len(points) < FEWEST_POINTS:
        raise PointSetError(f"{name}: too few points: {len(points)} of at least {FEWEST_POINTS}")
    if not _spans_a_triangle(points):
        raise PointSetError(f"{name}: all points lie on one line")
    repeats = len(points) - len(np.unique(points.view(np.complex128)))
    if repeats:
        click.echo(f"fpmatch: note: {name}: points that repeat another: {repeats:,}", err=True)
    return NamedPoints(path, name, points)


def _spans_a_triangle(points: NDArray[np.float64]) -> bool:
    """Return whether the first point, the furthest from it, and that furthest from both do."""
    import numpy as np

    from fpmatch.pointset.delaunay.triangulate import triangulate

    tamed = points / (np.abs(points).max() or 1.0)  # so that squares stay finite
    offset = tamed - tamed[0]
    far = (offset**2).sum(axis=1).argmax()
    aside = np.abs(offset @ (-offset[far, 1], offset[far, 0])).argmax()
    return len(triangulate(points[[0, far, aside]]).triangles) > 0
