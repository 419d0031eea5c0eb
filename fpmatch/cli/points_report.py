"""A match of two point sets as a JSON object, as text, and as a table of its pairs."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.drawing.plots.point_caption import match_facts
from fpmatch.drawing.words import verdict
from fpmatch.output import atomic_write

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.pointset.point_match import PointMatch

LABEL_WIDTH: Final = 12
TRANSFORM: Final = ("scale", "rotation_deg", "tx", "ty")
PAIR_COLUMNS: Final = ("p", "q", "p_x", "p_y", "q_x", "q_y", "distance")


@dataclass(frozen=True, slots=True, eq=False)
class NamedPoints:
    """Hold the points of a file.

    Parameters
    ----------
    path : Path
        The file as it was given; "-" for standard input.
    name : str
        What to call it.
    points : ndarray of float64, shape (N, 2)
        Its rows.
    """

    path: Path
    name: str
    points: NDArray[np.float64]


def as_json(
    p: NamedPoints,
    q: NamedPoints,
    match: PointMatch,
    *,
    matcher: str,
    parameters: Mapping[str, float | None],
) -> str:
    """Return a match as one JSON object, a member a line; what does not exist is null."""
    t = match.transform
    transform = {} if t is None else {name: getattr(t, name) for name in TRANSFORM}
    document: dict[str, Any] = {
        "match": t is not None,
        "transform": None if t is None else {**transform, "matrix": t.matrix.tolist()},
        "pairs": match.pairs.tolist(),
        "matched_share": match.matched_share,
        "rms": None if t is None else match.rms,
        "chance": match.chance,
        "local_matches": match.local_matches,
        "reason": match.reason,
        "points": {"p": len(p.points), "q": len(q.points)},
        "matcher": matcher,
        **parameters,
        "p": str(p.path),
        "q": str(q.path),
    }
    members = (f'  "{key}": {json.dumps(v, allow_nan=False)}' for key, v in document.items())
    return "{\n" + ",\n".join(members) + "\n}"


def as_text(p: NamedPoints, q: NamedPoints, match: PointMatch) -> str:
    """Return the decision on the first line, and below it what was found."""
    counts = " and ".join(f"{len(given.points):,} in {given.name}" for given in (p, q))
    rows = [("Points", counts), *match_facts(match)]
    rows += [("Reason", match.reason)] if match.reason else []
    lines = (f"  {label:<{LABEL_WIDTH}}{text}" for label, text in rows)
    return "\n".join([verdict(match.transform is not None), *lines])


def write_pairs(path: Path, p: NamedPoints, q: NamedPoints, match: PointMatch) -> None:
    """Write a row a pair, with the columns `PAIR_COLUMNS`; only these where there is no match.

    `p` and `q` are rows counted from 0, `distance` is that of the pair after the transform.

    Raises
    ------
    OutputError
        If the file cannot be written; nothing is left behind then.
    """
    rows: Any = ()
    if match.transform is not None:
        ours, theirs = p.points[match.pairs[:, 0]], q.points[match.pairs[:, 1]]
        distance = np.hypot(*(match.transform.apply(ours) - theirs).T)
        columns = (*match.pairs.T, *ours.T, *theirs.T, distance)
        rows = zip(*(column.tolist() for column in columns), strict=True)
    with atomic_write(path) as binary, io.TextIOWrapper(binary, "utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(PAIR_COLUMNS)
        writer.writerows(rows)
