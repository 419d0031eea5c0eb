"""The similarity transform of the paper's eq. (1): ``q = t + s·R(θ)·p``."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.points import LARGEST, as_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True)
class Similarity:
    """Map points by rotation, uniform scale and shift: ``q = t + s·R(θ)·p`` (eq. 1).

    ``R(θ)`` is the matrix ``[[cos θ, -sin θ], [sin θ, cos θ]]``; with y pointing down, a positive
    angle is clockwise on screen.

    Parameters
    ----------
    scale : float
        Uniform scale s, positive.
    rotation : float
        Angle θ in radians.
    tx, ty : float
        Shift t, in the units of the target points.
    mirrored : bool
        Whether y is turned to -y before all else.

    Raises
    ------
    PointSetError
        If a value is not finite or the scale is not positive.

    Examples
    --------
    >>> import math
    >>> from fpmatch import Similarity
    >>> turn = Similarity(scale=2.0, rotation=math.pi / 2, tx=1.0, ty=0.0)
    >>> turn.apply([[1.0, 0.0]]).round(9).tolist()
    [[1.0, 2.0]]
    """

    scale: float = 1.0
    rotation: float = 0.0
    tx: float = 0.0
    ty: float = 0.0
    mirrored: bool = field(default=False, repr=False, kw_only=True)

    def __post_init__(self) -> None:
        values = (self.scale, self.rotation, self.tx, self.ty)
        if not all(abs(value) <= LARGEST for value in values) or self.scale <= 0:
            raise PointSetError("a similarity transform needs finite values and a positive scale")

    @classmethod
    def fit(
        cls,
        source: ArrayLike,
        target: ArrayLike,
        weights: ArrayLike | None = None,
        *,
        with_scale: bool = True,
    ) -> Similarity:
        """Fit the transform that maps `source` onto `target` by (weighted) least squares.

        Parameters
        ----------
        source, target : array_like of float, shape (N, 2)
            Paired points, N at least 1; one pair fixes a shift only.
        weights : array_like of float, shape (N,), optional
            Non-negative weights of the pairs (default: all 1).
        with_scale : bool
            Whether to fit the scale (default) or hold it at 1.

        Returns
        -------
        Similarity
            The least-squares transform; the identity's rotation and scale where all the points
            of a side coincide.

        Raises
        ------
        PointSetError
            If shapes differ, are empty, or a value is not finite.

        References
        ----------
        Umeyama, "Least-squares estimation of transformation parameters between two point
        patterns", PAMI 13 (1991), in its two-dimensional closed form without reflection.

        Examples
        --------
        >>> from fpmatch import Similarity
        >>> p = [[0, 0], [4, 0], [0, 2]]
        >>> Similarity.fit(p, Similarity(2.0, 0.5, 3.0, -1.0).apply(p)).scale
        2.0
        """
        p = as_points(source, "source")
        q = as_points(target, "target")
        if p.shape != q.shape or not len(p):
            raise PointSetError(
                f"a fit needs as many target as source points, at least one: {len(p)} and {len(q)}"
            )
        w = np.ones(len(p)) if weights is None else np.asarray(weights, dtype=np.float64)
        if w.shape != (len(p),) or not np.isfinite(w).all() or (w < 0).any() or w.sum() <= 0:
            raise PointSetError("weights must be finite, not negative, one a pair, not all zero")
        w = w / w.sum()
        p_mean, q_mean = w @ p, w @ q
        p0, q0 = p - p_mean, q - q_mean
        cosine = float(w @ (p0 * q0).sum(axis=1))
        sine = float(w @ (p0[:, 0] * q0[:, 1] - p0[:, 1] * q0[:, 0]))
        spread = float(w @ (p0 * p0).sum(axis=1))
        strength = math.hypot(cosine, sine)
        rotation = math.atan2(sine, cosine) if strength > 0 else 0.0
        scale = strength / spread if with_scale and spread > 0 and strength > 0 else 1.0
        rotated = scale * (_rotation_matrix(rotation) @ p_mean)
        return cls(scale, rotation, float(q_mean[0] - rotated[0]), float(q_mean[1] - rotated[1]))

    @classmethod
    def of_move(cls, move: ArrayLike) -> Similarity:
        """Return the transform of a kernel's (s·cos θ, s·sin θ, tx, ty), shape (4,)."""
        a, b, tx, ty = np.asarray(move, dtype=np.float64).tolist()
        return cls(math.hypot(a, b), math.atan2(b, a), tx, ty)

    @property
    def rotation_deg(self) -> float:
        """Rotation in degrees, in (-180, 180]."""
        degrees = math.degrees(math.remainder(self.rotation, 2 * math.pi))
        return 180.0 if degrees == -180.0 else degrees

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The matrix ``[A | t]``, shape (2, 3), as ``cv2.warpAffine`` takes it."""
        a, b = self.scale * math.cos(self.rotation), self.scale * math.sin(self.rotation)
        side = -1.0 if self.mirrored else 1.0
        return np.array([[a, -b * side, self.tx], [b, a * side, self.ty]])

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """Map `points` (array_like, shape (N, 2)); returns float64 of the same shape."""
        matrix = self.matrix
        return np.asarray(as_points(points) @ matrix[:, :2].T + matrix[:, 2])

    def inverse(self) -> Similarity:
        """Return the transform that undoes this one."""
        scale = 1.0 / self.scale
        with np.errstate(over="ignore", invalid="ignore"):
            t = -scale * (_rotation_matrix(-self.rotation) @ (self.tx, self.ty))
        if self.mirrored:  # which exchanges the senses of rotation
            return Similarity(scale, self.rotation, float(t[0]), -float(t[1]), mirrored=True)
        return Similarity(scale, -self.rotation, float(t[0]), float(t[1]))

    def after(self, first: Similarity) -> Similarity:
        """Return the composition that applies `first`, then this transform."""
        tx, ty = self.apply([[first.tx, first.ty]])[0].tolist()
        turn = -first.rotation if self.mirrored else first.rotation
        rotation = math.remainder(self.rotation + turn, 2 * math.pi)
        mirrored = self.mirrored != first.mirrored
        return Similarity(self.scale * first.scale, rotation, tx, ty, mirrored=mirrored)


def _rotation_matrix(angle: float) -> NDArray[np.float64]:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine], [sine, cosine]])
