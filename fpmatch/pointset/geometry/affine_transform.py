"""Affine transforms, ``q = t + A·p``: mirrored similarities, and maps that stretch and shear."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.points import as_points, is_finite

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

_SINGULAR: Final = (
    1e-14  # determinant of a matrix of largest entry 1, below which it has no inverse
)
_ROUNDING: Final = 1e-9


class HasMatrix(Protocol):
    """A transform with a 2 x 3 matrix, as `Similarity` and `AffineTransform` are."""

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The matrix ``[A | t]``."""


@dataclass(frozen=True, slots=True)
class AffineTransform:
    """Map points by an invertible matrix and a shift: ``q = t + A·p``.

    ``A = R(θ)·[[1, k], [0, 1]]·diag(sx, ±sy)``: y is mirrored where the sign is negative, the axes
    are scaled by sx and sy, x is sheared by k·y, and the result is rotated by θ as in `Similarity`.

    Parameters
    ----------
    xx, xy, tx : float
        First row of the matrix ``[A | t]``; the shift is in the units of the target points.
    yx, yy, ty : float
        Second row.

    Raises
    ------
    PointSetError
        If a value is not finite, or A has no inverse.

    Examples
    --------
    >>> from fpmatch import AffineTransform
    >>> mirror = AffineTransform.of_parts(scale_x=2.0, scale_y=2.0, mirrored=True)
    >>> mirror.apply([[1.0, 3.0]]).tolist(), mirror.determinant
    ([[2.0, -6.0]], -4.0)
    """

    xx: float = 1.0
    xy: float = 0.0
    tx: float = 0.0
    yx: float = 0.0
    yy: float = 1.0
    ty: float = 0.0

    def __post_init__(self) -> None:
        values = (self.xx, self.xy, self.tx, self.yx, self.yy, self.ty)
        finite = all(map(is_finite, values))
        if not finite or abs(self._tamed[1]) < _SINGULAR:
            raise PointSetError("an affine transform needs finite values and an inverse")

    @classmethod
    def of_matrix(cls, matrix: ArrayLike) -> AffineTransform:
        """Return the transform of a matrix ``[A | t]`` (array_like, shape (2, 3))."""
        return cls(*np.asarray(matrix, dtype=np.float64).reshape(6).tolist())

    @classmethod
    def of_parts(
        cls,
        scale_x: float = 1.0,
        scale_y: float = 1.0,
        shear: float = 0.0,
        rotation: float = 0.0,
        tx: float = 0.0,
        ty: float = 0.0,
        *,
        mirrored: bool = False,
    ) -> AffineTransform:
        """Return the transform of scales, shear k, rotation θ in radians, and shift."""
        c, s = math.cos(rotation), math.sin(rotation)
        y = -scale_y if mirrored else scale_y
        k = shear * y
        return cls(c * scale_x, c * k - s * y, tx, s * scale_x, s * k + c * y, ty)

    @classmethod
    def fit(cls, source: ArrayLike, target: ArrayLike) -> AffineTransform:
        """Fit the transform that maps `source` onto `target` by least squares.

        Parameters
        ----------
        source, target : array_like of float, shape (N, 2)
            Paired points, N at least 3.

        Returns
        -------
        AffineTransform
            The least-squares transform.

        Raises
        ------
        PointSetError
            If shapes differ, a value is not finite, or the points of a side lie on one line.

        Examples
        --------
        >>> from fpmatch import AffineTransform
        >>> p = [[0, 0], [4, 0], [0, 2], [1, 1]]
        >>> AffineTransform.fit(p, [[x + y + 5, 3 * y + 1] for x, y in p]).matrix.round(9).tolist()
        [[1.0, 1.0, 5.0], [0.0, 3.0, 1.0]]
        """
        p, q = as_points(source, "source"), as_points(target, "target")
        if p.shape != q.shape or len(p) < 3:
            raise PointSetError(
                f"an affine fit needs as many target as source points, at least three: {len(p)} "
                f"and {len(q)}"
            )
        middle = p.mean(axis=0)
        linear, _, rank, _ = np.linalg.lstsq(p - middle, q - q.mean(axis=0), rcond=None)
        if rank < 2:
            raise PointSetError("points on one line determine no affine transform")
        shift = q.mean(axis=0) - middle @ linear
        return cls.of_matrix(np.column_stack([linear.T, shift]))

    @property
    def _tamed(self) -> tuple[float, float]:
        """The largest entry of A, and the determinant of A over it, which stays in float64."""
        most = max(abs(self.xx), abs(self.xy), abs(self.yx), abs(self.yy))
        if most == 0:
            return 0.0, 0.0
        return most, (self.xx / most) * (self.yy / most) - (self.xy / most) * (self.yx / most)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The 2 x 3 matrix ``[A | t]``, as ``cv2.warpAffine`` takes it."""
        return np.array([[self.xx, self.xy, self.tx], [self.yx, self.yy, self.ty]])

    @property
    def determinant(self) -> float:
        """Determinant of A: the ratio of areas, negative where the map is mirrored."""
        most, determinant = self._tamed
        return most * determinant * most

    @property
    def mirrored(self) -> bool:
        """Whether the map exchanges clockwise and counter-clockwise."""
        return self._tamed[1] < 0

    @property
    def scale(self) -> float:
        """Scale of a square of equal area: ``√|det A|``."""
        most, determinant = self._tamed
        return most * math.sqrt(abs(determinant))

    @property
    def scale_x(self) -> float:
        """Scale sx of the x axis."""
        return math.hypot(self.xx, self.yx)

    @property
    def scale_y(self) -> float:
        """Scale sy of the y axis, across the image of the x axis."""
        most, determinant = self._tamed
        return most * (abs(determinant) / (self.scale_x / most))

    @property
    def shear(self) -> float:
        """Shear k of x by y, after scaling."""
        most, determinant = self._tamed
        along = (self.xx / most) * (self.xy / most) + (self.yx / most) * (self.yy / most)
        return along / determinant

    @property
    def rotation(self) -> float:
        """Angle θ of the image of the x axis, in radians."""
        return math.atan2(self.yx, self.xx)

    @property
    def rotation_deg(self) -> float:
        """Rotation in degrees, in (-180, 180]."""
        degrees = math.degrees(self.rotation)
        return 180.0 if degrees == -180.0 else degrees

    @property
    def anisotropy(self) -> float:
        """Ratio of the largest to the least scale over all directions; 1 for similarities."""
        plus = math.hypot(self.xx + self.yy, self.yx - self.xy)
        minus = math.hypot(self.xx - self.yy, self.yx + self.xy)
        largest = (plus + minus) / 2
        most, determinant = self._tamed
        return (largest / most) ** 2 / abs(determinant)

    @property
    def is_similarity(self) -> bool:
        """Whether the map is a rotation with uniform scale, mirrored or not, but for rounding."""
        return self.anisotropy < 1 + _ROUNDING

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """Map `points` (array_like, shape (N, 2)); returns float64 of the same shape."""
        matrix = self.matrix
        return np.asarray(as_points(points) @ matrix[:, :2].T + matrix[:, 2])

    def inverse(self) -> AffineTransform:
        """Return the transform that undoes this one."""
        most, determinant = self._tamed
        adjoint = np.array([[self.yy, -self.xy], [-self.yx, self.xx]]) / most
        linear = adjoint / determinant / most
        return self.of_matrix(np.column_stack([linear, -linear @ (self.tx, self.ty)]))

    def after(self, first: HasMatrix) -> AffineTransform:
        """Return the composition that applies `first`, then this transform."""
        linear, before = self.matrix[:, :2], first.matrix
        shift = linear @ before[:, 2] + (self.tx, self.ty)
        return self.of_matrix(np.column_stack([linear @ before[:, :2], shift]))
