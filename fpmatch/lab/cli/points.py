"""`fpmatch points`: the transform between two files of points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.base.parameters import Parameter, read_parameters
from fpmatch.cli.command import Command
from fpmatch.cli.notes import show
from fpmatch.cli.options import FILE, file_option, json_option
from fpmatch.errors import PointSetError, unknown_name
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.lab.plots.style import check_plot
from fpmatch.lab.points.match import POINT_MATCHERS, match_points
from fpmatch.lab.points.points_csv import load_table
from fpmatch.pointset.paper.matcher import DEFAULT_RHO
from fpmatch.printable import json_text, printable
from fpmatch.prints.report import LABEL_WIDTH, verdict

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.lab.points.points_csv import PointTable
    from fpmatch.pointset.geometry.point_match import PointMatch

_RHO: Final = Parameter("rho", DEFAULT_RHO, "share of points paired", "", 0, 1)
_PAIR_COLUMNS: Final = ("p", "q", "p_x", "p_y", "q_x", "q_y", "distance", "p_name", "q_name")


@click.command(
    cls=Command,
    details="""
Both files are tables with columns x and y, among others, or two columns of numbers without a
header; separated by commas, or by tabs and spaces. The rotation counts from the x axis towards the
y axis. --pairs writes a row a pair: rows of P and Q, counted from 0 without the header, both
points, their distance, and the values in the first other column of each table, as their names.

\b
JSON:
  match          whether a transform was found
  transform      scale, rotation_deg, tx, ty, mirrored (whether y was turned to -y before all
                 else), and the 2 x 3 matrix of them; or null
  pairs          [row of P, row of Q] each, counted from 0 without the header; of rows with the
                 same point, the matcher triangles pairs the first
  matched_share  pairs over points of the smaller set
  rms            root mean square distance of the pairs, in the units of Q; or null
  chance         matches as good expected between independent sets; or null
  local_matches  how many local matches the search followed
  reason         why there is no match, and whether the search ended at its limit; empty where
                 there is one
  equal_maps     how many maps were found that fit equally well, where there are several, as of a
                 regular grid; there is no match then; else 1
  points         how many points P and Q have
  matcher, tolerance, rho, reflect, p, q: as given; null where not

\b
Matchers:
  triangles      fast, and right where points are missing, moved and strewn among others; matches
                 where so many pairs are not to be expected by chance
  paper          the method of Choi, Lee and Lee; matches where more than a share rho of the
                 points of the smaller set is paired (default 0.6, the least of the paper's
                 experiments)
  van-wamelen    the paper's baseline; matches where a share rho of P is paired (default 0.6)
""",
    epilog="""\b
Examples:
  fpmatch points stars.csv catalogue.csv
  fpmatch points stars.csv catalogue.csv --json --plot match.png
  fpmatch points spots.csv gel.csv --tolerance 2.5 --pairs pairs.csv
  fpmatch points stars.csv catalogue.csv --matcher paper:rho=0.9
  fpmatch points negative.csv catalogue.csv --reflect

Exit status: 0 match, 1 no match, 2 input that cannot be used.
""",
)
@click.argument("p", metavar="P.csv", type=FILE)
@click.argument("q", metavar="Q.csv", type=FILE)
@click.option(
    "--matcher",
    metavar=f"[{'|'.join(POINT_MATCHERS)}][:PARAMETER=VALUE,...]",
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
@json_option
@file_option("--plot", metavar="OUT.png|.svg|.pdf", help="Draw P, moved by the transform, on Q.")
@file_option(
    "--pairs",
    metavar="OUT.csv",
    help="Write a row a pair: rows, points, distance and names.",
)
def points(
    p: Path,
    q: Path,
    matcher: str,
    reflect: bool,
    tolerance: float | None,
    as_json: bool,
    plot: Path | None,
    pairs: Path | None,
) -> int:
    """Find the scale, rotation and shift that map the points of P.csv to points of Q.csv.

    Both are tables with columns x and y, or two columns of numbers. Not every point needs a
    partner.
    """
    from fpmatch.lab.plots.style import save_point_plot

    if plot is not None:
        check_plot(plot)
    if pairs is not None:
        check_writable(pairs, what="a list of pairs", suffixes=(".csv",))
    given = _chosen(matcher, tolerance)
    names = printable(p), printable(q)
    tables = load_table(p), load_table(q)
    try:
        match = match_points(*(table.points for table in tables), reflect=reflect, **given)
    except PointSetError as error:  # which may be of a set, by its letter
        letter, colon, why = str(error).partition(": ")
        name = dict(zip("pq", names, strict=True)).get(letter, letter)
        raise PointSetError(f"{name}{colon}{why}") from error
    if as_json:
        document = _document(match)
        document["points"] = dict(zip("pq", (len(table.points) for table in tables), strict=True))
        document |= given | {"reflect": reflect, "p": str(p), "q": str(q)}
        members = (f'  "{key}": {json_text(v, indent=None)}' for key, v in document.items())
        show("{\n" + ",\n".join(members) + "\n}")
    else:
        counts = (f"{len(t.points):,} in {name}" for name, t in zip(names, tables, strict=True))
        rows = [("Points", " and ".join(counts)), *match.facts()]
        rows += [("Reason", match.reason)] if match.reason else []
        lines = (f"  {label:<{LABEL_WIDTH}}{text}" for label, text in rows)
        show("\n".join([verdict(match.transform is not None), *lines]))
    # after the decision, which no file that cannot be written is to cost
    if pairs is not None:
        _write_pairs(pairs, *tables, match)
    if plot is not None:
        save_point_plot(plot, tables[0].points, tables[1].points, match, names=names)
    return 0 if match.transform is not None else 1


def _chosen(text: str, tolerance: float | None) -> dict[str, Any]:
    """Return the matcher that a text states and its parameters, None where not given."""
    name, _, stated = text.partition(":")
    if name not in POINT_MATCHERS:
        raise PointSetError(unknown_name("matcher", name, POINT_MATCHERS))
    owner = f"matcher {name}"
    given = read_parameters(stated, owner) if stated else {}
    for unknown in given.keys() - {"rho"}:
        raise PointSetError(f"{owner} has no parameter {unknown!r}")
    rho = _RHO.read(given["rho"], owner) if given else None
    return {"matcher": name, "tolerance": tolerance, "rho": rho}


def _document(match: PointMatch) -> dict[str, Any]:
    """Return a match as members of a JSON object; what does not exist is null."""
    t, transform = match.transform, None
    if t is not None:
        names = "scale", "rotation_deg", "tx", "ty", "mirrored"
        transform = {**{name: getattr(t, name) for name in names}, "matrix": t.matrix.tolist()}
    return {
        "match": t is not None,
        "transform": transform,
        "pairs": match.pairs.tolist(),
        "matched_share": match.matched_share,
        "rms": None if t is None else match.rms,
        "chance": match.chance,
        "local_matches": match.local_matches,
        "reason": match.reason,
        "equal_maps": match.equal_maps,
    }


def _write_pairs(path: Path, p: PointTable, q: PointTable, match: PointMatch) -> None:
    """Write a row a pair; the columns alone where there is no match."""
    rows: list[tuple[Any, ...]] = []
    if match.transform is not None:
        moved = match.transform.apply(p.points)
        for i, j in match.pairs.tolist():
            ours, theirs = p.points[i].tolist(), q.points[j].tolist()
            distance = float(np.hypot(*(moved[i] - q.points[j])))
            names = (of.names[k] if of.names else "" for of, k in ((p, i), (q, j)))
            rows.append((i, j, *ours, *theirs, distance, *names))
    atomic_write_bytes(path, csv_lines([_PAIR_COLUMNS, *rows]), public=True)
