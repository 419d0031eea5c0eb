"""The result of matching two point sets, and the shares ρ that decide it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.errors import PointSetError, number_text

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset.geometry.similarity import Similarity


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PointMatch:
    """The result of matching P with Q.

    Parameters
    ----------
    transform : Similarity or None
        Maps P onto Q; None where there is no match.
    pairs : ndarray of int32, shape (K, 2)
        Indices (into P, into Q), one-to-one, sorted by the first.
    matched_share : float
        K over the number of points in the smaller set; 0 where there is no match.
    rms : float
        Root mean square distance of the pairs after the transform, in the units of Q.
    local_matches : int
        Number of local matches that were followed: pairs of similar rings, pairs of similar
        triangles that passed their test, or pairs of similar neighbourhoods.
    chance : float or None
        Expected number of matches as good between independent sets; None where the matcher does
        not estimate it.
    reason : str
        Why there is no match; "" where there is one.
    equal_maps : int
        How many maps were found that fit equally well, where there are several; else 1. There is
        no match then, since nothing shows which of them is the true one.
    """

    transform: Similarity | None
    pairs: NDArray[np.int32]
    matched_share: float
    rms: float
    local_matches: int
    chance: float | None = None
    reason: str = ""
    equal_maps: int = 1

    def __repr__(self) -> str:
        if self.transform is None:
            return f"PointMatch(no match{f': {self.reason}' if self.reason else ''})"
        chance = "" if self.chance is None else f", chance={self.chance:.2g}"
        return f"PointMatch({len(self.pairs)} pairs, rms={self.rms:.3g}{chance}, {self.transform})"

    @classmethod
    def none(cls, local_matches: int = 0, reason: str = "") -> PointMatch:
        """Return the result of a search that found no match."""
        empty = np.empty((0, 2), np.int32)
        return cls(None, empty, 0.0, 0.0, local_matches, reason=reason)

    def facts(self) -> list[tuple[str, str]]:
        """Return the match as (label, value): pairs, transform, residual, chance; [] without."""
        t = self.transform
        if t is None:
            return []
        turn = round(t.rotation_deg, 3)  # the sense holds wherever y points
        sense = "" if turn == 0 else " from x to y" if turn > 0 else " from y to x"
        x, y = (round(value, 12) + 0.0 for value in (t.tx, t.ty))  # errors of rounding are 0
        mirror = "mirrored (y to -y), " if t.mirrored else ""
        movement = f"rotation {abs(turn):.3f}°{sense}, shift {x:+.6g}, {y:+.6g}"
        facts = [
            ("Pairs", f"{len(self.pairs):,}, {self.matched_share:.1%} of the smaller set"),
            ("Transform", f"{mirror}scale {t.scale:.6g}, {movement}"),
            ("Residual", f"{self.rms:.4g} rms"),
        ]
        if self.chance is not None:
            count = f"{self.chance:.2g}" if self.chance > 0 else "less than 1e-300"
            facts.append(("Chance", f"{count} matches as good expected between independent sets"))
        return facts

    def inverse(self) -> PointMatch:
        """Return the match of Q with P."""
        if self.transform is None:
            return self
        pairs = np.ascontiguousarray(self.pairs[self.pairs[:, 1].argsort(), ::-1])
        transform = self.transform.inverse()
        return replace(self, transform=transform, pairs=pairs, rms=self.rms * transform.scale)


def too_few(fewest: int) -> str:
    """Return the reason why sets of fewer points do not match."""
    return f"sets of fewer than {fewest} points match too many others by chance"


def rms_distance(p: NDArray[np.float64], q: NDArray[np.float64]) -> float:
    """Return the root mean square distance of paired points, shape (K, 2) each; 0 for none."""
    residual = p - q
    return math.sqrt(float((residual * residual).sum(axis=1).mean())) if len(residual) else 0.0


def check_rho(rho: float) -> None:
    """Refuse a matching factor ρ outside 0..1 with a `PointSetError`."""
    if not 0 <= rho <= 1:
        raise PointSetError(f"rho must lie in 0..1, not {number_text(rho)}")


def fewest_above(rho: float, count: int) -> int:
    """Return the fewest of `count` points that are more than a share ρ of them."""
    fewest = math.floor(rho * count)
    while count and fewest / count <= rho:  # as the reported share is compared with ρ
        fewest += 1
    return fewest


def share_of(rho: float, count: int) -> int:
    """Return ⌈ρ·count⌉: the fewest of `count` points that are a share ρ in [0, 1] of them."""
    rounding = 1e-9  # 0.55·100 is 55.000000000000007 in floating point
    return math.ceil(rho * count - rounding)
