"""`fpmatch points`: the transform between two files of points."""

from __future__ import annotations

import csv
import io
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from fpmatch.base.output import atomic_write, check_writable
from fpmatch.base.parameters import Parameter, parameters_of, read_parameters
from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, show
from fpmatch.cli.options import file_option, json_option
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import PointSetError, did_you_mean, unknown_name
from fpmatch.lab.plots.style import match_facts
from fpmatch.lab.points.match import match_points, mirrored_matches
from fpmatch.lab.points.points_csv import XY
from fpmatch.pointset.paper.matcher import DEFAULT_RHO, UnitCircleParameters
from fpmatch.printable import json_text, printable
from fpmatch.prints.report import LABEL_WIDTH, verdict

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.pointset.geometry.point_match import PointMatch

STDIN: Final = Path("-")
STDIN_NAME: Final = "standard input"
_CSV: Final = click.Path(path_type=Path, allow_dash=True)
_TRANSFORM: Final = ("scale", "rotation_deg", "tx", "ty")
_RHO: Final = {"rho": Parameter("rho", DEFAULT_RHO, "share of points paired", "", 0, 1)}
_AREAS: Final = "area_tolerance"
_PARAMETERS: Final[Mapping[str, Mapping[str, Parameter]]] = {
    "triangles": {},
    "paper": {**_RHO, _AREAS: parameters_of(UnitCircleParameters())[_AREAS]},
    "van-wamelen": _RHO,
}
_PAIR_COLUMNS: Final = ("p", "q", "p_x", "p_y", "q_x", "q_y", "distance")


@dataclass(frozen=True, slots=True, eq=False)
class _NamedPoints:
    """The points of a file, as rows of (x, y); `path` is "-" for standard input."""

    path: Path
    name: str
    points: NDArray[np.float64]


def _column_names(text: str) -> tuple[str, str]:
    """Return the two names of columns that a text on the command line means."""
    x, _, y = (part.strip() for part in text.partition(","))
    if not (x and y) or "," in y or x.casefold() == y.casefold():
        raise click.BadParameter(f"{text!r} is not two names of columns, as ra,dec")
    return x, y


@click.command(
    cls=Command,
    details="""
Both files are tables with columns x and y, among others, or two columns of numbers without a
header; separated by comma, semicolon or tab. The rotation counts from the x axis towards the y
axis. After no match by the matcher triangles, a short search tries whether --reflect would find
one, and the reason names it.

\b
JSON:
  match          whether a transform was found
  transform      scale, rotation_deg, tx, ty, and the 2 x 3 matrix of them; or null. With
                 --reflect also mirrored: whether y was turned to -y before all else
  pairs          [row of P, row of Q] each, counted from 0 without the header
  matched_share  pairs over points of the smaller set
  rms            root mean square distance of the pairs, in the units of Q; or null
  chance         matches as good expected between independent sets; or null
  local_matches  how many local matches the search followed
  reason         why there is no match, whether the search ended at its limit, and whether
                 --reflect finds a match; empty where there is one
  equal_maps     how many maps were found that fit equally well, where there are several, as of a
                 regular grid; there is no match then; else 1
  points         how many points P and Q have
  matcher, tolerance, rho, area_tolerance, p, q: as given; null where not
  reflect: where it is given

\b
Matchers:
  triangles      fast, and right where points are missing, moved and strewn among others; matches
                 where so many pairs are not to be expected by chance
  paper          the method of Choi, Lee and Lee; matches where more than a share rho of the
                 points of the smaller set is paired (default 0.6, the least of the paper's
                 experiments); area_tolerance, which the paper does not give, is the largest
                 difference in area of similar rings on the unit circle (default 0.1)
  van-wamelen    the paper's baseline; matches where a share rho of P is paired (default 0.6)
""",
    epilog="""\b
Examples:
  fpmatch points stars.csv catalogue.csv
  fpmatch points stars.csv catalogue.csv --json --plot match.png
  fpmatch points spots.csv gel.csv --tolerance 2.5 --pairs pairs.csv
  fpmatch points stars.csv catalogue.csv --columns ra,dec
  fpmatch points stars.csv catalogue.csv --matcher paper:rho=0.9
  fpmatch points negative.csv catalogue.csv --reflect
  cut -f 2,3 stars.tsv | fpmatch points - catalogue.csv

Exit status: 0 match, 1 no match, 2 input that cannot be used.
""",
)
@click.argument("p", metavar="P.csv", type=_CSV)
@click.argument("q", metavar="Q.csv", type=_CSV)
@click.option(
    "--matcher",
    metavar=f"[{'|'.join(_PARAMETERS)}][:PARAMETER=VALUE,...]",
    default="triangles",
    help="Matcher to use, perhaps with parameters, see below.",
)
@click.option(
    "--reflect", is_flag=True, help="Seek mirrored maps too, as of a plate seen from behind."
)
@click.option(
    "--tolerance",
    type=float,
    metavar="T",
    help="How far a partner may lie from its place, in the units of Q.  "
    "[default: a share of Q's spacing]",
)
@click.option(
    "--columns",
    metavar="X,Y",
    type=_column_names,
    multiple=True,
    help="Columns of the tables, as ra,dec; twice where Q.csv has other names.  [default: x,y]",
)
@json_option
@file_option("--plot", metavar="OUT.png|.svg", help="Draw P, moved by the transform, on Q.")
@file_option(
    "--pairs",
    metavar="OUT.csv",
    help="Write a row a pair: its rows in P and Q, both points, their distance.",
)
def points(
    p: Path,
    q: Path,
    matcher: str,
    reflect: bool,
    tolerance: float | None,
    columns: tuple[tuple[str, str], ...],
    as_json: bool,
    plot: Path | None,
    pairs: Path | None,
) -> int:
    """Find the scale, rotation and shift that map the points of P.csv to points of Q.csv.

    Both are tables with columns x and y, or --columns, or two columns of numbers. A dash (-)
    reads standard input. Not every point needs a partner.
    """
    from fpmatch.lab.plots.point_plot import check_plot, save_point_plot

    if p == q == STDIN:
        raise click.UsageError("only one of the sets can come from standard input")
    if len(columns) > 2:
        raise click.UsageError("--columns is given once for both sets, or once for each")
    if plot is not None:
        check_plot(plot)
    if pairs is not None:
        check_writable(pairs, what="a list of pairs", suffixes=(".csv",))
    given = _chosen(matcher, tolerance)
    named = columns or (XY,)
    ours, theirs = _read(p, named[0]), _read(q, named[-1])
    with ProgressBars({"search": "searching"}) as bars:
        match = _match(ours, theirs, reflect, given, bars)
    if as_json:
        show(_as_json(ours, theirs, match, given, reflect=reflect))
    else:
        show(_as_text(ours, theirs, match))
    # after the decision, which no file that cannot be written is to cost
    if pairs is not None:
        _write_pairs(pairs, ours, theirs, match)
    if plot is not None:
        names = ours.name, theirs.name
        save_point_plot(plot, ours.points, theirs.points, match, names=names)
    return 0 if match.transform is not None else 1


def _chosen(text: str, tolerance: float | None) -> dict[str, Any]:
    """Return the options of the matcher that a text states, None where not given."""
    name, _, stated = text.partition(":")
    if name not in _PARAMETERS:
        raise PointSetError(unknown_name("matcher", name, _PARAMETERS))
    values: dict[str, Any] = {"matcher": name, "tolerance": tolerance}
    values |= {"rho": None, "area_tolerance": None}
    known, owner = _PARAMETERS[name], f"matcher {name}"
    given = read_parameters(stated, owner) if stated else {}
    for parameter, value in given.items():
        if parameter not in known:
            question = did_you_mean(parameter, known)
            raise PointSetError(f"{owner} has no parameter {parameter!r}.{question}")
        values[parameter] = known[parameter].read(value, owner)
    return values


def _match(
    p: _NamedPoints, q: _NamedPoints, reflect: bool, given: Mapping[str, Any], bars: ProgressBars
) -> PointMatch:
    """Match two sets; where they do not, state in the reason whether they do with --reflect."""

    def progress(tried: int, most: int) -> None:
        bars.show("search", tried, most, f"{tried:,} transforms")

    try:
        match = match_points(p.points, q.points, **given, reflect=reflect, progress=progress)
    except PointSetError as error:  # which may be of a set, by its letter
        letter, colon, why = str(error).partition(": ")
        name = {"p": p.name, "q": q.name}.get(letter, letter)
        raise PointSetError(f"{name}{colon}{why}") from error
    if match.transform is not None or match.equal_maps > 1 or given["matcher"] != "triangles":
        return match
    how = {"tolerance": given["tolerance"], "progress": progress}
    if reflect or not mirrored_matches(p.points, q.points, **how):
        return match
    return replace(match, reason=f"{match.reason}; --reflect finds a match")


def _read(path: Path, columns: tuple[str, str]) -> _NamedPoints:
    """Return the points of a file; say where some of them coincide."""
    from fpmatch.lab.points.points_csv import MAX_BYTES, decode_points, load_points

    if path != STDIN:
        name, points = printable(path), load_points(path, columns)
    elif sys.stdin is not None:
        name, data = STDIN_NAME, sys.stdin.buffer.read(MAX_BYTES + 1)
        points = decode_points(data, name, columns)
    else:
        raise PointSetError(f"{STDIN_NAME}: is closed")
    repeats = len(points) - len(np.unique(points.view(np.complex128)))
    if repeats:
        say_note(f"{name}: points that repeat another: {repeats:,}")
    return _NamedPoints(path, name, points)


def _as_json(
    p: _NamedPoints,
    q: _NamedPoints,
    match: PointMatch,
    given: Mapping[str, str | float | None],
    *,
    reflect: bool,
) -> str:
    """Return a match as one JSON object, a member a line; what does not exist is null.

    Members of mirrored maps are left out unless `reflect` is set.
    """
    t = match.transform
    names = (*_TRANSFORM, "mirrored") if reflect else _TRANSFORM
    transform = {} if t is None else {name: getattr(t, name) for name in names}
    document: dict[str, Any] = {
        "match": t is not None,
        "transform": None if t is None else {**transform, "matrix": t.matrix.tolist()},
        "pairs": match.pairs.tolist(),
        "matched_share": match.matched_share,
        "rms": None if t is None else match.rms,
        "chance": match.chance,
        "local_matches": match.local_matches,
        "reason": match.reason,
        "equal_maps": match.equal_maps,
        "points": {"p": len(p.points), "q": len(q.points)},
        **given,
        **({"reflect": True} if reflect else {}),
        "p": str(p.path),
        "q": str(q.path),
    }
    members = (f'  "{key}": {json_text(v, indent=None)}' for key, v in document.items())
    return "{\n" + ",\n".join(members) + "\n}"


def _as_text(p: _NamedPoints, q: _NamedPoints, match: PointMatch) -> str:
    """Return the decision on the first line, and below it what was found."""
    counts = " and ".join(f"{len(given.points):,} in {given.name}" for given in (p, q))
    rows = [("Points", counts), *match_facts(match)]
    rows += [("Reason", match.reason)] if match.reason else []
    lines = (f"  {label:<{LABEL_WIDTH}}{text}" for label, text in rows)
    return "\n".join([verdict(match.transform is not None), *lines])


def _write_pairs(path: Path, p: _NamedPoints, q: _NamedPoints, match: PointMatch) -> None:
    """Write a row a pair; the columns alone where there is no match.

    Columns p and q are rows counted from 0, distance is that of the pair after the transform.
    """
    rows: Any = ()
    if match.transform is not None:
        ours, theirs = p.points[match.pairs[:, 0]], q.points[match.pairs[:, 1]]
        distance = np.hypot(*(match.transform.apply(ours) - theirs).T)
        columns = (*match.pairs.T, *ours.T, *theirs.T, distance)
        rows = zip(*(column.tolist() for column in columns), strict=True)
    with (
        atomic_write(path, public=True) as binary,
        io.TextIOWrapper(binary, "utf-8", newline="") as stream,
    ):
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_PAIR_COLUMNS)
        writer.writerows(rows)
