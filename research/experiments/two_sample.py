"""Two-sample test of images: how accurately a classifier separates patches of two databases.

Patches are described by local statistics of their ridges, and a linear classifier of those and
their squares is fitted. All patches of a finger are in one fold of the cross-validation. Where the
images are of one kind, half of the patches are classified correctly; sensors differ, too.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np
from scipy.stats import ks_2samp

from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Patches = Mapping[Any, Floats]  # the statistics of each finger's patches
    Field = NDArray[np.float32]

SIDE_PX: Final = 48  # of a patch, at 500 dpi
MOST_PATCHES: Final = 12  # of an image
INSIDE: Final = 0.95  # share of a patch that must be print
PERIODS_PX: Final = (4.5, 18.0)
BANDS: Final = (0.3, 0.6, 0.85, 1.2, 1.6, 2.4, 3.4)  # frequencies over that of the ridges
ALONG_BANDS: Final = (0.02, 0.07, 0.13, 0.22, 0.34, 0.5)  # in cycles a pixel
SECTOR_DEG: Final = 28.0  # around a direction
SMALL: Final = 0.35  # largest area of a dot or pore, periods squared
BLOCK_PX: Final = 12  # over which contrast and darkness are compared
QUANTILES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
FOLDS: Final = 5
MOST_NAMED: Final = 4  # statistics that differ most
PENALTY: Final = 3.0  # of the squared weights of standardised features
_ROUNDS: Final = 12  # of Newton's method
_TINY: Final = 1e-6

NAMES: Final = (
    "contrast", *(f"grey at {q:g}" for q in QUANTILES), "skewness", "kurtosis", "saturated",
    "period", *(f"across ridges at {f:g}" for f in BANDS[:-1]), "across ridges above",
    *(f"along ridges at {f:g}" for f in ALONG_BANDS[:-1]), "oblique below", "oblique above",
    "variation of period", "steepness across", "steepness along", "noise of ridges",
    "noise of valleys", "ridge share", "ridge width", "its spread", "its low", "its high",
    "valley width spread", "ridge run", "its low run", "valley run", "its low valley run",
    "roughness of edges", "pores", "dots", "contrast spread", "darkness spread",
    "beading of crests", "beading of valleys",
)  # fmt: skip
"""The statistics of a patch, in order."""


def patches_of(grey: NDArray[np.uint8], mask: NDArray[np.bool_], orientation: Field) -> Floats:
    """Return the statistics of an image's patches, (patches, statistics).

    All arrays are (H, W) at 500 dpi, ridges dark; `orientation` is in radians, counter-clockwise.
    """
    share = cv2.boxFilter(mask.astype(np.float32), -1, (SIDE_PX, SIDE_PX))
    half = SIDE_PX // 2 + 10  # a turned patch needs more
    share[:half], share[-half:], share[:, :half], share[:, -half:] = 0, 0, 0, 0
    step = SIDE_PX // 2
    centres = np.argwhere(share[::step, ::step] > INSIDE) * step
    if len(centres) > MOST_PATCHES:
        centres = centres[np.linspace(0, len(centres) - 1, MOST_PATCHES).astype(int)]
    described = []
    for y, x in centres:
        near = orientation[y - step : y + step, x - step : x + step]
        doubled = np.nanmean(np.exp(2j * near))
        degrees = -float(np.degrees(np.angle(doubled) / 2))
        turn = np.asarray(cv2.getRotationMatrix2D((float(x), float(y)), degrees, 1), np.float64)
        turn[:, 2] += SIDE_PX / 2 - np.array([x, y])
        patch = cv2.warpAffine(grey, turn, (SIDE_PX, SIDE_PX), flags=cv2.INTER_CUBIC)
        described.append(describe(np.asarray(patch, np.uint8)))
    return np.array(described).reshape(-1, len(NAMES))


def describe(patch: NDArray[np.uint8]) -> Floats:
    """Return the statistics `NAMES` of a patch whose ridges run from left to right."""
    contrast = float(patch.std()) + _TINY
    g = (patch.mean() - patch.astype(np.float64)) / contrast  # ridges positive
    saturated = float(((patch == patch.max()) | (patch == patch.min())).mean())
    quantiles = np.quantile(g, QUANTILES)
    spectrum, period = _spectrum(g)
    soft = cv2.GaussianBlur(g, (0, 0), 0.7)
    ridges = soft > cv2.GaussianBlur(g, (0, 0), 0.75 * period)
    fine = g - cv2.medianBlur(g.astype(np.float32), 3)
    across, along = np.abs(np.diff(g, axis=0)), np.abs(np.diff(g, axis=1))
    level = cv2.GaussianBlur(g, (0, 0), 1.0)
    crest = _crests(level)
    valley = _crests(-level)
    edges = [
        float(np.quantile(across, 0.95)), float(along.mean() / (across.mean() + _TINY)),
        _deviation(fine[ridges]), _deviation(fine[~ridges]),
    ]  # fmt: skip
    values = [
        np.log(contrast), *quantiles, (g**3).mean(), np.log((g**4).mean() + _TINY),
        np.sqrt(saturated), np.log(period), *spectrum, *edges,
        *_widths(ridges, period), *_parts(ridges, period), *_spreads(g),
        _deviation(level[crest]), _deviation(level[valley]),
    ]  # fmt: skip
    return np.nan_to_num(np.array(values, np.float64))


def _spectrum(g: Floats) -> tuple[list[float], float]:
    """Return the shares of energy by direction and frequency, the period's variation, and it."""
    window = np.hanning(SIDE_PX)[:, None] * np.hanning(SIDE_PX)
    power = np.abs(np.fft.fft2(g * window)) ** 2
    f = np.fft.fftfreq(SIDE_PX)
    fy, fx = f[:, None], f[None]
    radius, angle = np.hypot(fy, fx), np.degrees(np.arctan2(np.abs(fy), np.abs(fx)))
    is_across, is_along = angle > 90 - SECTOR_DEG, angle < SECTOR_DEG
    likely = is_across & (radius > 1 / PERIODS_PX[1]) & (radius < 1 / PERIODS_PX[0])
    weight = power * likely
    f0 = float((radius * weight**2).sum() / ((weight**2).sum() + _TINY)) + _TINY
    total = power[radius > BANDS[0] * f0].sum() + _TINY
    ends = [*BANDS, 99.0]
    shares = [
        power[is_across & (radius >= low * f0) & (radius < high * f0)].sum()
        for low, high in pairwise(ends)
    ]
    shares += [
        power[is_along & (radius >= low) & (radius < high)].sum()
        for low, high in pairwise(ALONG_BANDS)
    ]
    oblique = ~is_across & ~is_along
    shares += [
        power[oblique & (radius < 1.2 * f0)].sum(),
        power[oblique & (radius > 1.2 * f0)].sum(),
    ]
    half = SIDE_PX // 2
    parts = (g[:half], g[half:], g[:, :half], g[:, half:])
    counts = [np.log(np.count_nonzero(np.diff(p > 0, axis=0)) / p.size + _TINY) for p in parts]
    variation = abs(counts[0] - counts[1]) + abs(counts[2] - counts[3])
    period = float(np.clip(1 / f0, *PERIODS_PX))
    return [*np.log(np.array(shares) / total + 1e-5), variation], period


def _crests(level: Floats) -> NDArray[np.bool_]:
    """Return the pixels that are the highest across the ridges, (H, W)."""
    above = np.zeros(level.shape, bool)
    above[2:-2] = (level[2:-2] >= level[1:-3]) & (level[2:-2] >= level[3:-1])
    above[2:-2] &= (level[2:-2] > level[:-4]) & (level[2:-2] > level[4:])
    return above & (level > 0)


def _widths(ridges: NDArray[np.bool_], period: float) -> list[float]:
    """Return share, widths over the period, and lengths of runs along the ridges."""
    width, gap = _runs(ridges.T) / period, _runs(~ridges.T) / period
    run, break_ = _runs(ridges), _runs(~ridges)
    mean = width.mean() + _TINY
    low, high = np.quantile(width, [0.1, 0.9])
    lengths = [np.log(value) for v in (run, break_) for value in (v.mean(), np.quantile(v, 0.2))]
    spreads = [width.std() / mean, low, high, gap.std() / (gap.mean() + _TINY)]
    return [float(ridges.mean()), mean, *spreads, *lengths]


def _runs(lines: NDArray[np.bool_]) -> Floats:
    """Return the lengths of the runs of True along the rows."""
    padded = np.pad(lines, ((0, 0), (1, 1))).ravel().astype(np.int8)
    change = np.flatnonzero(np.diff(padded))
    lengths = (change[1::2] - change[::2]).astype(np.float64)
    return lengths if lengths.size else np.ones(1)


def _parts(ridges: NDArray[np.bool_], period: float) -> list[float]:
    """Return the roughness of the edges, and the numbers of pores and of dots."""
    changes = [np.count_nonzero(np.diff(ridges, axis=axis)) for axis in (0, 1)]
    counts = []
    for part in (~ridges, ridges):
        _, _, stats, _ = cv2.connectedComponentsWithStats(part.astype(np.uint8), connectivity=4)
        left, top = stats[1:, cv2.CC_STAT_LEFT], stats[1:, cv2.CC_STAT_TOP]
        right, bottom = left + stats[1:, cv2.CC_STAT_WIDTH], top + stats[1:, cv2.CC_STAT_HEIGHT]
        inner = (left > 0) & (top > 0) & (right < SIDE_PX) & (bottom < SIDE_PX)
        small = inner & (stats[1:, cv2.CC_STAT_AREA] < SMALL * period**2)
        counts.append(float(np.sqrt(np.count_nonzero(small))))
    return [changes[1] / (changes[0] + 1), *counts]


def _spreads(g: Floats) -> list[float]:
    """Return how contrast and darkness differ between blocks."""
    n = SIDE_PX // BLOCK_PX
    blocks = g.reshape(n, BLOCK_PX, n, BLOCK_PX).swapaxes(1, 2).reshape(n * n, -1)
    deviations = blocks.std(axis=1)
    return [float(deviations.std() / (deviations.mean() + _TINY)), float(blocks.mean(axis=1).std())]


def _deviation(values: Floats) -> float:
    return float(values.std()) if values.size > 1 else 0.0


def two_sample(one: Patches, others: Mapping[str, Patches]) -> dict[str, Any]:
    """Return how accurately the patches of a database are classified against each other database.

    Each maps a finger to its patches; `all` is the accuracy against all databases together, and
    `most_different` are the statistics that differ most from them.
    """
    each = {name: accuracy(one, other)[0] for name, other in others.items()}
    fingers = (patches for other in others.values() for patches in other.values())
    share, names = accuracy(one, dict(enumerate(fingers)))
    return {"each": each, "all": share, "most_different": names[:MOST_NAMED]}


def format_accuracies(sets: Sequence[Mapping[str, Any]]) -> str:
    """Return the results of `two_sample`, under that key, as a table: one row for each database."""
    names = sets[0]["two_sample"]["each"]
    rows = [["classification accuracy against", *names, "all", "most different statistics"]]
    for one in sets:
        result = one["two_sample"]
        each = (*result["each"].values(), result["all"])
        shares = ["-" if share is None else f"{100 * share:.0f} %" for share in each]
        rows.append([one["name"], *shares, ", ".join(result["most_different"])])
    return markdown_table(rows)


def accuracy(one: Patches, other: Patches) -> tuple[float | None, list[str]]:
    """Return the mean share of patches of each side that are classified correctly.

    Both map a finger to its patches. The fingers of each fold are classified by the others. The
    names of the statistics come with it, the one that differs most first. The share is
    None where a side has patches of fewer than two fingers.
    """
    sides = [sorted((f, p) for f, p in side.items() if len(p)) for side in (one, other)]
    if min(map(len, sides)) < 2:
        return None, []
    folds = min(FOLDS, *map(len, sides))
    x = np.concatenate([patches for side in sides for _, patches in side])
    label = np.repeat([0.0, 1.0], [sum(len(p) for _, p in side) for side in sides])
    fold = np.concatenate(
        [np.full(len(p), n % folds) for side in sides for n, (_, p) in enumerate(side)]
    )
    scale = x.std(axis=0) + _TINY
    z = np.clip((x - x.mean(axis=0)) / scale, -4, 4)
    columns = np.column_stack([z, z**2 - 1, np.ones(len(z))])
    correct = np.zeros(len(z))
    for k in range(folds):
        test = fold == k
        weights = _fitted(columns[~test], label[~test])
        correct[test] = (columns[test] @ weights > 0) == (label[test] > 0)
    balanced = np.mean([correct[label == side].mean() for side in (0, 1)])
    return round(float(balanced), 4), [NAMES[i] for i in np.argsort(-_distances(z, label))]


def _distances(z: Floats, label: Floats) -> Floats:
    """Return the Kolmogorov-Smirnov distance of each statistic alone, 0 to 1."""
    test = ks_2samp(z[label == 0], z[label == 1], method="asymp", axis=0)
    return np.asarray(test.statistic)


def _fitted(x: Floats, label: Floats) -> Floats:
    """Fit a logistic regression of which both classes have one weight, by Newton's method."""
    share = label.mean()
    importance = np.where(label > 0, 0.5 / share, 0.5 / (1 - share))
    penalty = PENALTY * np.eye(x.shape[1])
    weights = np.zeros(x.shape[1])
    for _ in range(_ROUNDS):
        p = 1 / (1 + np.exp(-np.clip(x @ weights, -30, 30)))
        slope = x.T @ (importance * (p - label)) + penalty @ weights
        curvature = (x * (importance * (p * (1 - p) + 1e-4))[:, None]).T @ x + penalty
        weights = weights - np.linalg.solve(curvature, slope)
    return weights
