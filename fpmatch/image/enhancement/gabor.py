"""Gabor filters: every pixel is filtered along its ridge, which suppresses noise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.image.enhancement import _oriented_filter_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class EnhancementParameters:
    """Set the bank of oriented filters; lengths in pixels at 500 dpi."""

    angles: int = 32
    periods_px: tuple[float, ...] = (5.5, 6.3, 7.2, 8.2, 9.3, 10.5, 11.9, 13.4, 15.0)
    radius_px: int = 12
    along_sigma_px: float = 5.0
    across_sigma_periods: float = 0.42


def gabor_filter(
    pixels: NDArray[np.float32],
    mask: NDArray[np.bool_],
    orientation: NDArray[np.float32],
    period: NDArray[np.float32],
    parameters: EnhancementParameters | None = None,
) -> NDArray[np.float32]:
    """Filter each pixel of the mask with the Gabor filter of its orientation and period.

    All arrays are (H, W): normalized image with positive ridges, mask, ridge orientation (radians,
    counter-clockwise from +x) and ridge period (pixels). The result is 0 outside the mask.

    References
    ----------
    Hong, Wan, Jain, "Fingerprint image enhancement: algorithm and performance evaluation",
    PAMI 20 (1998).
    """
    p = parameters or EnhancementParameters()
    if not pixels.shape == mask.shape == orientation.shape == period.shape:
        raise ValueError("pixels, mask, orientation and period must have one shape")
    bank = filter_bank(p)
    y, x = np.nonzero(mask)
    angle_index = np.rint(orientation[y, x] * (p.angles / np.pi)).astype(np.int64) % p.angles
    edges = np.sqrt(np.multiply(p.periods_px[:-1], p.periods_px[1:]))
    period_index = np.searchsorted(edges, period[y, x])
    which = (angle_index * len(p.periods_px) + period_index).astype(np.int32)
    padded = np.pad(
        np.ascontiguousarray(pixels, np.float32),
        ((p.radius_px, p.radius_px), (p.radius_px, kernel.ROW)),
    )
    out = np.zeros(pixels.shape, np.float32)
    filter_listed = kernel.filter_pixels if kernel.COMPILED else filter_with_numpy
    filter_listed(padded, y.astype(np.int32), x.astype(np.int32), which, bank, out)
    return out


def filter_with_numpy(
    padded: NDArray[np.float32],
    y: NDArray[np.int32],
    x: NDArray[np.int32],
    which: NDArray[np.int32],
    bank: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Filter as the kernel does: the uncompiled path, and the kernel's oracle."""
    side = bank.shape[1]
    windows = np.lib.stride_tricks.sliding_window_view(padded, (side, bank.shape[2]))
    if not len(which):
        return
    order = np.argsort(which, kind="stable")
    used, starts = np.unique(which[order], return_index=True)
    for index, members in zip(used, np.split(order, starts[1:]), strict=True):
        neighbourhoods = windows[y[members], x[members]].reshape(len(members), -1)
        out[y[members], x[members]] = neighbourhoods @ bank[index].ravel()


@lru_cache(maxsize=4)
def filter_bank(p: EnhancementParameters) -> NDArray[np.float32]:
    """Return the Gabor filters, shape (angles·periods, side, kernel.ROW), of zero mean.

    The gain of a filter for its own wave is one.
    """
    r = np.arange(-p.radius_px, p.radius_px + 1, dtype=np.float64)
    x, y = np.meshgrid(r, r)
    bank = np.zeros((p.angles * len(p.periods_px), r.size, kernel.ROW), np.float32)
    for a in range(p.angles):
        angle = a * np.pi / p.angles
        along = x * np.cos(angle) - y * np.sin(angle)
        across = x * np.sin(angle) + y * np.cos(angle)
        for f, period in enumerate(p.periods_px):
            sigma = p.across_sigma_periods * period
            window = np.exp(-((along / p.along_sigma_px) ** 2 + (across / sigma) ** 2) / 2)
            wave = np.cos(2 * np.pi * across / period)
            gabor = window * (wave - (window * wave).sum() / window.sum())
            bank[a * len(p.periods_px) + f, :, : r.size] = gabor / (gabor * wave).sum()
    return bank
