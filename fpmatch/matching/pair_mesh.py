"""The mesh of pairs: the Delaunay triangulation of the paired minutiae of two prints.

A one-ring of the minutiae of a print rarely appears again in another print of the finger, because
minutiae are missing or spurious. Among the minutiae that are paired it does, by construction: the
rings have equal degree, and the paper's unit circle can be compared. `_pair_mesh_kernel` has the
method and its sources.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PairMeshParameters:
    """Set the mesh of pairs; lengths in pixels at 500 dpi.

    Parameters
    ----------
    frame_margin_px : float
        Distance of the frame points from the circle round the minutiae's bounding box.
    place_tolerance : float
        Standard deviation of the places on the unit circle, in radians.
    residual_px, residual_per_px : float
        Standard deviation of the distance from the prediction: the base, and the growth with the
        mean radius of the ring.
    """

    frame_margin_px: float = 60.0
    place_tolerance: float = 0.3
    residual_px: float = 3.0
    residual_per_px: float = 0.08
