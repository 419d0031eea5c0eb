"""Parameters of the preparation of prints, which kernels and reference read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.base.parameters import parameter

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class PreparationParameters:
    """Preparation of a template.

    Where it has no ridge field, the cells of the minutiae's hull stand for the print.
    """

    max_minutiae: int = parameter(
        200, "minutiae that take part; of more, those of best quality", 1, 256
    )
    hull_step_px: float = parameter(
        16.0, "side of a cell of the hull, where a template has no ridge field", 4, 64
    )
    max_hull_cells: int = parameter(
        512, "such cells along a side; larger ones where the minutiae reach farther", 16, 512
    )
    usual_quality: float = parameter(
        0.7, "quality where a template gives none: all are 100, or all 0", 0, 1
    )


@dataclass(frozen=True, slots=True)
class NeighbourhoodParameters:
    """Neighbourhoods of the minutiae, with the shape-preserving weights of eq. (4)."""

    neighbours: int = parameter(
        12, "neighbours of a minutia, nearest first, from its first and second ring", 1, 32
    )
    tolerance_px: float = parameter(
        9.0, "how far a neighbour may lie from its counterpart", 0.1, 100
    )
    tolerance_per_px: float = parameter(
        0.08, "what a px of the neighbour's own distance adds to it", 0, 0.5
    )
    second_ring_weight: float = parameter(
        0.5, "weight of neighbours beyond the one-ring, the least in it; the mean is 1", 0, 1
    )


@dataclass(frozen=True, slots=True)
class BitDescriptorParameters:
    """Prefilter: bit descriptors of minutiae, and pairs of them that agree in one transform.

    `flow_rings` are places of ridge orientation: number, distance from the minutia, angle of the
    first in degrees. Two pairs d apart agree within ``sqrt(near_px² + (near_per_px·d)²)``.
    """

    cell_px: float = parameter(16.0, "side of the cells in which neighbours lie", 4, 64)
    flow_rings: tuple[tuple[int, float, float], ...] = ((4, 24.0, 45.0), (8, 42.0, 22.5))
    most_pairs: int = parameter(
        16, "pairs compared with each other: those that share most words", 1, 64
    )
    near_px: float = parameter(12.0, "distance within which two pairs agree", 0, 100)
    near_per_px: float = parameter(0.1, "what a px between them adds to it, squared", 0, 1)
    pair_turn_deg: float = parameter(
        15.0, "largest difference of the rotations of two pairs", 0, 22.5
    )

    @property
    def places(self) -> NDArray[np.float64]:
        """Places of ridge orientation in a minutia's own frame, shape (2, 12)."""
        radius = np.concatenate([np.full(n, r) for n, r, _ in self.flow_rings])
        degrees = np.concatenate([a + 360 / n * np.arange(n) for n, _, a in self.flow_rings])
        angle = np.radians(degrees)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)])
