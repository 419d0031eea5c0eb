"""The probe warped onto the reference through the pairs of minutiae: for looking.

Skin stretches, so that no similarity transform aligns all pairs. The matcher follows it on the
Delaunay mesh of the pairs, which eight frame points around the print close
(`_pair_mesh_kernel`). Here the mesh maps each triangle affinely; outside the
frame the similarity transform holds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.drawing.scene.ink import at_pixels
from fpmatch.drawing.scene.items import Ink, zoomed
from fpmatch.templates.minutiae import STANDARD_DPI, Minutiae

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.drawing.scene.items import Box
    from fpmatch.matching.verification import Verification
    from fpmatch.pointset.geometry.similarity import Similarity

    Points = NDArray[np.float64]

LEAST_PAIRS: Final = 3
_FRAME: Final = 8  # frame points
_FRAME_MARGIN_PX: Final = 60.0  # at 500 dpi, of the frame from the minutiae
_LEAST_AREA_RATIO: Final = 0.05  # of a triangle in the two prints; with less it counts as folded
_NODE_PX: Final = 4  # page pixels between the places whose displacement is interpolated
_STEP_PX: Final = 2.0  # along a minutia's direction, to see how it turns
_ROUNDING: Final = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class PairWarp:
    """Map the probe's pixels to the reference's on the mesh of the pairs, of V vertices."""

    transform: Similarity
    before: Points  # (V, 2): the vertices as the similarity transform maps them
    after: Points  # (V, 2): where the mesh maps them in the reference
    mesh: Any  # scipy.spatial.Delaunay of `after`
    pairs: int  # vertices that are pairs

    def to_reference(self, points: ArrayLike) -> Points:
        """Map pixels of the probe, shape (N, 2), to the reference's."""
        moved = np.array(self.transform.apply(points), np.float64)
        corners = self.before[self.mesh.simplices]
        to_shares = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
        shares = np.einsum("tij,ntj->nti", to_shares, moved[:, None, :] - corners[:, 0])
        shares = np.concatenate([1.0 - shares.sum(2, keepdims=True), shares], axis=2)
        inside: NDArray[np.bool_] = np.all(shares >= -_ROUNDING, axis=2)
        chosen = np.flatnonzero(np.any(inside, axis=1))
        triangle = np.argmax(inside[chosen], axis=1)
        there = self.after[self.mesh.simplices[triangle]]
        moved[chosen] = np.einsum("ni,nij->nj", shares[chosen, triangle], there)
        return moved

    def displacement(self, points: Points) -> Points:
        """Return what leads from pixels of the reference to where the transform maps them."""
        from scipy.interpolate import LinearNDInterpolator  # noqa: PLC0415  (imported when drawn)

        field = LinearNDInterpolator(self.mesh, self.before - self.after, fill_value=0.0)
        return np.asarray(field(points))

    def minutiae(self, minutiae: Minutiae) -> Minutiae:
        """Return minutiae of the probe as they lie in the reference."""
        xy = minutiae.xy.astype(np.float64)
        ahead = _STEP_PX * np.column_stack([np.cos(minutiae.angle), -np.sin(minutiae.angle)])
        here = self.to_reference(xy)
        dx, dy = (self.to_reference(xy + ahead) - here).T
        angle = (np.arctan2(-dy, dx) % (2 * math.pi)).astype(np.float32)
        x, y = here.T.astype(np.float32)
        return Minutiae(x, y, angle, minutiae.kind, minutiae.quality)

    def ink(self, ink: Ink, to_page: NDArray[np.float64], panel: Box) -> Ink:
        """Return the warped ink of the probe inside a panel of the page.

        `ink` is placed by the similarity transform; `to_page` maps the reference's pixels.
        """
        import cv2  # noqa: PLC0415

        width, height = math.ceil(panel.width), math.ceil(panel.height)
        zoom = to_page[0, 0]
        columns, rows = (np.arange(0, n + 2 * _NODE_PX, _NODE_PX) for n in (width, height))
        first = panel.x + 0.5, panel.y + 0.5  # the centre of the first pixel
        nodes = np.stack(np.meshgrid(columns, rows), axis=2) + np.array(first)
        field = zoom * self.displacement((nodes - to_page[:2, 2]) / zoom)
        places = at_pixels(
            field.astype(np.float32), 1 / _NODE_PX, 0.0, (height, width), cv2.BORDER_REPLICATE
        )
        places[..., 0] += first[0] + np.arange(width, dtype=np.float32)
        places[..., 1] += first[1] + np.arange(height, dtype=np.float32)[:, None]
        from_page = np.linalg.inv(ink.matrix)
        u, v = (
            (a * places[..., 0] + b * places[..., 1] + c).astype(np.float32)
            for a, b, c in from_page[:2].tolist()
        )
        warped = cv2.remap(ink.coverage, u, v, cv2.INTER_CUBIC, borderValue=0)
        to_panel = zoomed(1.0, (0.0, 0.0), first)
        return Ink(np.asarray(warped, np.uint8), ink.colour, to_panel, ink.role)


def pair_warp(verification: Verification) -> tuple[PairWarp | None, str]:
    """Return the warp through the pairs of a verification, and how the probe is drawn, in words.

    Pairs at which the mesh folds over are left out. There is no warp where fewer than three are
    left: the words say why.
    """
    v = verification
    if v.transform is None or len(v.pairs) < LEAST_PAIRS:
        return None, not_warped("fewer than three pairs")
    ours, theirs = (side.minutiae.xy.astype(np.float64) for side in (v.probe, v.reference))
    points = v.mesh_points or (ours[v.pairs[:, 0]], theirs[v.pairs[:, 1]])
    before, after = v.transform.apply(points[0]), points[1]
    frame = _frame(v.transform.apply(ours), _FRAME_MARGIN_PX * v.reference.dpi / STANDARD_DPI)
    warp = _without_folds(v.transform, before, after, frame)
    if warp is None:
        return None, not_warped("the mesh of the pairs folds over")
    whole = "" if warp.pairs == len(v.pairs) else f" of {len(v.pairs)}"
    return warp, f"warped through {warp.pairs}{whole} pairs: for looking, not for measuring"


def not_warped(reason: str) -> str:
    """Return how the probe is drawn where it cannot be warped."""
    return f"similarity transform, not warped: {reason}"


def _frame(points: Points, margin: float) -> Points:
    """Return points on the circle around the box of some points, `margin` beyond it."""
    low, high = points.min(axis=0), points.max(axis=0)
    radius = 0.5 * float(np.hypot(*(high - low))) + margin
    angles = 2 * math.pi / _FRAME * np.arange(_FRAME)
    around: Points = (low + high) / 2 + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return around


def _without_folds(
    transform: Similarity, before: Points, after: Points, frame: Points
) -> PairWarp | None:
    """Return the warp through the pairs, without those at which its triangles fold over."""
    from scipy.spatial import Delaunay, QhullError  # noqa: PLC0415  (imported when drawn)

    keep = np.arange(len(before))
    while len(keep) >= LEAST_PAIRS:
        here, there = (np.vstack([frame, side[keep]]) for side in (before, after))
        try:
            mesh = Delaunay(there)
        except (QhullError, ValueError):
            return None
        areas = _areas(there[mesh.simplices])
        folded = _areas(here[mesh.simplices]) < np.maximum(_LEAST_AREA_RATIO * areas, _ROUNDING)
        if not folded.any():
            used = np.unique(mesh.simplices)
            pairs = int(np.count_nonzero(used >= _FRAME))
            return PairWarp(transform, here, there, mesh, pairs) if pairs >= LEAST_PAIRS else None
        # of the pairs at most folded triangles the one that is displaced the most
        corners = np.bincount(mesh.simplices[folded].ravel(), minlength=len(there))[_FRAME:]
        displaced = np.hypot(*(before[keep] - after[keep]).T)
        worst = np.lexsort([displaced, corners])[-1]
        keep = np.delete(keep, worst)
    return None


def _areas(triangles: Points) -> Points:
    """Return the areas of triangles, (T, 3, 2), of the orientation that Qhull gives them."""
    (ux, uy), (vx, vy) = (
        (triangles[:, 1] - triangles[:, 0]).T,
        (triangles[:, 2] - triangles[:, 0]).T,
    )
    return np.asarray(ux * vy - uy * vx)
