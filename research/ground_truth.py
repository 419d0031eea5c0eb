"""The command ``check truth``: extracted minutiae and transforms against those of synthetic prints.

`load_truth` reads the files that `fpmatch synth` writes beside its prints.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.lab.synthesis.truth_file import TRUTH_FOLDER
from fpmatch.lab.synthesis.warp import solved
from fpmatch.matching.verify import verify
from fpmatch.pointset.geometry.points import as_points
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import STANDARD_DPI, Minutiae
from research.commands import Command, folders, workers
from research.databases import extract_folders
from research.markdown import markdown_table

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.templates.minutiae import Template

    Points = NDArray[np.float64]  # (N, 2)

WITHIN_PX, WITHIN_TURN = 12.0, math.pi / 8  # of a true minutia, at 500 dpi
BORDER_PX: Final = 18.0  # largest distance from the border of the print, two ridge periods
NEAR_PX: Final = 10.0  # largest distance of near minutiae, a ridge period
CAUSES: Final = ("direction", "border", "no ridges", "near another", "other")
MIN_COMMON: Final = 12  # true minutiae of a pair whose transform is judged
IN_PLACE_DEG, IN_PLACE_PX = 2.0, 4.0  # largest errors of a transform in place, at 500 dpi


@dataclass(frozen=True, slots=True, eq=False)
class ImpressionTruth:
    """The ground truth of one impression; positions in pixels of its image.

    `transform` maps the finger's master print onto the image, up to the shift of the skin, of which
    `shift` (2, rows, columns) has x and y at nodes `step` pixels apart, from one before the image's
    first on. For each minutia, `master` holds its index in the finger's minutiae. `hidden_xy` has
    the finger's other minutiae, in the image or beyond it: listed but not visible, and not listed.
    """

    transform: Similarity
    minutiae: Minutiae
    master: NDArray[np.int64]
    visible: NDArray[np.bool_]
    hidden_xy: Points
    step: float = 1.0
    shift: NDArray[np.float64] | None = None

    def to_master(self, points: ArrayLike) -> Points:
        """Map image `points` (N, 2) to the master print."""
        p = as_points(points)
        return self.transform.inverse().apply(p + self._shift_at(p))

    def from_master(self, points: ArrayLike) -> Points:
        """Map `points` (N, 2) of the master print to the image."""
        placed = self.transform.apply(points)
        return solved(placed, lambda p: -self._shift_at(p), tolerance=1e-6)

    def _shift_at(self, points: Points) -> Points:
        """Return the shifts at points, by cubic splines of the nodes."""
        from scipy.ndimage import map_coordinates  # noqa: PLC0415

        if self.shift is None:
            return np.zeros_like(points)
        place = points[:, ::-1].T / self.step + 1
        rows = [map_coordinates(part, place, order=3, mode="nearest") for part in self.shift]
        return np.stack(rows, axis=1)


def load_truth(dataset: Dataset) -> tuple[ImpressionTruth, ...]:
    """Read the truth of a database's prints; DatasetError if a file lacks it."""
    folder = dataset.impressions[0].path.parent / TRUTH_FOLDER
    stems = [impression.path.stem for impression in dataset.impressions]
    read = {path.stem: json.loads(path.read_text("ascii")) for path in folder.glob("*.json")}
    try:
        pairs = [(read[stem.partition("_")[0]], stem) for stem in stems]
        return tuple(_truth(one, one["impressions"][s]) for one, s in pairs)
    except KeyError as error:
        raise DatasetError(f"{folder}: no truth of {error}") from error


def _truth(finger: dict[str, Any], impression: dict[str, Any]) -> ImpressionTruth:
    columns, grid = impression["minutiae"], impression["displacement"]
    angle = np.radians(np.array(columns["angle_deg"], dtype=np.float64))
    minutiae = Minutiae(x=columns["x"], y=columns["y"], angle=angle, kind=columns["kind"])
    numbers = impression["transform"]
    transform = Similarity(*(numbers[key] for key in ("scale", "rotation", "tx", "ty")))
    master, visible = np.array(columns["master"], np.int64), np.array(columns["visible"], bool)
    shift = np.array([grid["dx"], grid["dy"]], np.float64)
    truth = ImpressionTruth(
        transform, minutiae, master, visible, np.empty((0, 2)), float(grid["step"]), shift
    )
    of_finger = np.array([finger["minutiae"]["x"], finger["minutiae"]["y"]], np.float64).T
    unlisted = truth.from_master(np.delete(of_finger, master, axis=0))
    return replace(truth, hidden_xy=np.vstack([minutiae.xy[~visible], unlisted]))


def assign_minutiae(
    extracted: Minutiae, true: Minutiae, visible: NDArray[np.bool_], px: float, turn: float
) -> NDArray[np.intp]:
    """Assign extracted minutiae to true ones within `px` and `turn`, one to one: indices (K, 2).

    The assignment has the most visible true minutiae, then the most invisible ones, then the least
    sum of squared distances and turns in units of their limits.
    """
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415

    distance = _distances(extracted.xy, true.xy)
    turned = extracted.angle[:, None].astype(np.float64) - true.angle[None]
    turned = np.abs(np.mod(turned + np.pi, 2 * np.pi) - np.pi)
    allowed = (distance <= px) & (turned <= turn)
    # one more pair is worth more than all distances, a visible one more than all invisible ones
    one_more = 2.0 * (min(allowed.shape) + 1)
    worth = np.where(visible, one_more * (min(allowed.shape) + 1), one_more)
    apart = (distance / px) ** 2 + (turned / turn) ** 2
    i, j = linear_sum_assignment(np.where(allowed, apart - worth, 0.0))
    return np.column_stack([i, j])[allowed[i, j]]


def count_minutiae(template: Template | None, truth: ImpressionTruth) -> Counter[str]:
    """Count the true minutiae that are "visible" and those "right", and false ones by `CAUSES`.

    A minutia at an invisible true one is neither right nor false. The causes, the first that
    applies: an unassigned true minutia is there, but points elsewhere; the border is near; of all
    the finger's minutiae, the nearest is hidden; another minutia is so near that a ridge must be
    split or doubled. Template and truth are in pixels of the same image.
    """
    counts = Counter({"visible": int(truth.visible.sum())})
    if template is None or not len(template.minutiae):
        return counts
    px = template.dpi / STANDARD_DPI
    found, true, visible = template.minutiae, truth.minutiae, truth.visible
    pairs = assign_minutiae(found, true, visible, WITHIN_PX * px, WITHIN_TURN)
    counts["right"] = int(visible[pairs[:, 1]].sum())
    false = np.setdiff1d(np.arange(len(found)), pairs[:, 0])
    free = np.setdiff1d(np.arange(len(true)), pairs[:, 1])
    suspect = found.take(false)
    turned = assign_minutiae(suspect, true.take(free), visible[free], WITHIN_PX * px, math.pi)
    others = _distances(suspect.xy, found.xy)
    others[np.arange(len(false)), false] = np.inf
    hidden, seen = (
        _distances(suspect.xy, xy).min(axis=1, initial=np.inf)
        for xy in (truth.hidden_xy, true.xy[visible])
    )
    applies = [
        np.isin(np.arange(len(false)), turned[:, 0]),
        distance_to_border(template, suspect.xy) <= BORDER_PX * px,
        hidden < seen,
        others.min(axis=1) <= NEAR_PX * px,
        np.ones(len(false), bool),
    ]
    counts.update(CAUSES[k] for k in np.argmax(applies, axis=0))
    return counts


def _distances(one: NDArray[np.floating], other: NDArray[np.floating]) -> NDArray[np.float64]:
    apart = np.asarray(one, np.float64)[:, None] - other[None]
    return np.asarray(np.hypot(apart[..., 0], apart[..., 1]))


def distance_to_border(template: Template, points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the distances of points (N, 2) from the border of the print or image; 0 outside."""
    x, y = np.asarray(points, dtype=np.float64).T
    to_edge = np.min([x, y, template.width - x, template.height - y], axis=0).clip(min=0.0)
    if (field := template.field) is None or field.mask.all():
        return np.asarray(to_edge)
    rows, columns = np.nonzero(~field.mask)  # blocks without ridges
    across = np.abs(x[:, None] - (columns + 0.5) * field.step) - field.step / 2
    down = np.abs(y[:, None] - (rows + 0.5) * field.step) - field.step / 2
    to_background = np.hypot(across.clip(min=0.0), down.clip(min=0.0)).min(axis=1)
    return np.asarray(np.minimum(to_edge, to_background))


def measure_transform(
    found: Similarity | None, probe: ImpressionTruth, reference: ImpressionTruth, dpi: float
) -> tuple[float, float, float]:
    """Return the errors of a transform from the probe's pixels to those of the reference.

    They are those of the rotation, in degrees; of the mapped middle of the true minutiae that are
    visible in both prints; and the root mean square distance of these and the mapped ones. Lengths
    are at 500 dpi, `dpi` is that of the reference. Without a transform they are infinite.
    """
    if found is None:
        return math.inf, math.inf, math.inf
    p, q = common_minutiae(probe, reference)
    true = reference.transform.after(probe.transform.inverse())
    rotation = abs(Similarity(rotation=found.rotation - true.rotation).rotation_deg)
    middle = p.mean(axis=0, keepdims=True)
    shift = np.hypot(*(found.apply(middle) - true.apply(middle))[0])
    residual = np.sqrt(((found.apply(p) - q) ** 2).sum(axis=1).mean())
    return rotation, float(shift) * STANDARD_DPI / dpi, float(residual) * STANDARD_DPI / dpi


def common_minutiae(probe: ImpressionTruth, reference: ImpressionTruth) -> tuple[Points, Points]:
    """Return the positions in each print of the minutiae visible in both, (N, 2) each."""
    p, q = ((one.master[one.visible], one.minutiae.xy[one.visible]) for one in (probe, reference))
    _, i, j = np.intersect1d(p[0], q[0], assume_unique=True, return_indices=True)
    return p[1][i].astype(np.float64), q[1][j].astype(np.float64)


@click.command(cls=Command)
@folders
@workers
def command(folders: tuple[Path, ...], workers: int | None) -> None:
    """Compare minutiae and transforms of prints by ``fpmatch synth`` in DIR with the truth.

    A minutia is right within 12 pixels and 22.5 degrees of a true one. Transforms of genuine pairs
    are judged where 12 true minutiae are visible in both.
    """
    rows = [_row(one) for one in extract_folders(folders, workers)]
    head = ["prints", "visible", "right", *(f"false: {cause}" for cause in CAUSES)]
    click.echo(markdown_table([[*head, "transforms", "in place", "residual"], *rows]))


def _row(extracted: Dataset) -> list[str]:
    truths = load_truth(extracted)
    prints = [
        (shown.finger, template, truth)
        for shown, template, truth in zip(
            extracted.impressions, extracted.templates, truths, strict=True
        )
    ]
    counts = sum((count_minutiae(template, truth) for _, template, truth in prints), Counter())
    errors = [
        measure_transform(verify(a, b).transform, one, other, b.dpi)
        for (finger, a, one), (mate, b, other) in combinations(prints, 2)
        if finger == mate and a is not None and b is not None
        if len(common_minutiae(one, other)[0]) >= MIN_COMMON
    ]
    in_place = sum(turn <= IN_PLACE_DEG and shift <= IN_PLACE_PX for turn, shift, _ in errors)
    residual = np.median([residual for *_, residual in errors] or [np.nan])
    cells = (str(counts[key]) for key in ("visible", "right", *CAUSES))
    name, judged = extracted.name, str(len(errors))
    return [name, *cells, judged, str(in_place), f"{residual:.2f} px"]
