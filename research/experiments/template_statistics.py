"""Statistics of templates, of their mates and of their non-mates, to compare kinds of prints.

Synthetic templates, made with images or without, are compared with real ones in this way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.index.prints.compare import similarities
from fpmatch.gallery.index.prints.descriptor_scores import SIZE_OFFSET, prefilter_scores
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.templates.minutiae import Template

SHARES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles of a distribution that are reported."""
TAILS: Final = (0.5, 0.9, 0.99, 0.999)
"""And of what non-mated pairs score."""
RATES: Final = (0.01, 0.001)
"""FMR of the first gallery at which the others are compared with it."""
MM_PER_PX: Final = 25.4 / STANDARD_DPI
NEAR_PX: Final = 48.0  # within which neighbours are counted
LEAST_SIMILARITY: Final = 8.0  # of mates whose paired minutiae are compared
MOST_MATES: Final = 600  # pairs of a group, evenly chosen

TITLES: Final = {
    "minutiae": ("minutiae", 0),
    "area_mm2": ("area, mm²", 0),
    "density": ("minutiae a mm²", 3),
    "spacing_px": ("distance of the nearest minutia, px", 1),
    "neighbours": ("minutiae within 48 px", 0),
    "flow_deg": ("direction against ridge flow, degrees", 1),
    "bifurcations": ("bifurcations, share", 2),
    "quality": ("quality of a minutia", 0),
    "paired": ("paired share of the common region, mates", 2),
    "overlap": ("overlap of mates", 2),
    "place_px": ("distance of paired minutiae, px", 1),
    "direction_deg": ("difference of their directions, degrees", 1),
    "kind": ("paired minutiae of one kind, share", 2),
    "ridges": ("ridge correlation of mates", 2),
    "mated": ("similarity of mates", 1),
}
"""The title of each statistic, and its decimals."""


@dataclass(frozen=True)
class Group:
    """The templates of one kind of print, and their fingers."""

    name: str
    templates: Sequence[Template]
    finger: Sequence[object]


def describe(group: Group) -> dict[str, Any]:
    """Return the quantiles of each of `TITLES` over the prints, minutiae or mates of a group."""
    prepared = [MATCHER.prepare(template) for template in group.templates]
    values = _of_prints(group.templates) | _of_mates(group, prepared)
    quantiles = {
        name: [float(q) for q in np.quantile(found, SHARES)] if len(found) else None
        for name, found in values.items()
    }
    mated = np.asarray(values["mated"])
    return {
        "name": group.name,
        "prints": len(group.templates),
        "mates": len(mated),
        "matched": float((mated >= LEAST_SIMILARITY).mean()) if len(mated) else None,
        "quantiles": quantiles,
    }


def non_mated(probes: Group, gallery: Group) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return similarities and prefilter scores of probes with all prints of other fingers."""
    many = PreparedPrints.pack(MATCHER.prepare(template) for template in gallery.templates)
    finger = np.array([hash(f) for f in gallery.finger])
    similarity, prefilter = [], []
    for template, own in zip(probes.templates, probes.finger, strict=True):
        probe = MATCHER.prepare(template)
        others = finger != hash(own)
        similarity.append(similarities(MATCHER, probe, many)[others])
        smaller = np.minimum(np.diff(many.minutiae_start), len(probe))
        prefilter.append((prefilter_scores(probe, many) / (smaller + SIZE_OFFSET))[others])
    return np.concatenate(similarity), np.concatenate(prefilter)


def compare_non_mates(probes: Group, galleries: Sequence[Group]) -> list[dict[str, Any]]:
    """Return how probes score with each gallery; its FMR where the first one has `RATES`."""
    found = [non_mated(probes, gallery) for gallery in galleries]
    thresholds = np.quantile(found[0][0], 1 - np.array(RATES))
    return [
        {
            "gallery": gallery.name,
            "prints": len(gallery.templates),
            "pairs": len(similarity),
            "similarity": [float(q) for q in np.quantile(similarity, TAILS)],
            "prefilter": [float(q) for q in np.quantile(prefilter, TAILS)],
            "fmr": [float((similarity >= t).mean()) for t in thresholds],
        }
        for gallery, (similarity, prefilter) in zip(galleries, found, strict=True)
    ]


def _of_prints(templates: Sequence[Template]) -> dict[str, NDArray[np.float64]]:
    """Return what single prints show."""
    found: dict[str, list[float]] = {name: [] for name in TITLES}
    for template in templates:
        m, field = template.minutiae, template.field
        assert field is not None
        to_500dpi = STANDARD_DPI / template.dpi
        area = float(field.mask.sum()) * (field.step * to_500dpi * MM_PER_PX) ** 2
        found["minutiae"].append(len(m))
        found["area_mm2"].append(area)
        found["density"].append(len(m) / area if area else np.nan)
        found["bifurcations"].append(float((m.kind == 2).mean()) if len(m) else np.nan)
        found["quality"] += m.quality.tolist()
        if len(m) < 2:
            continue
        between = np.hypot(*(np.subtract.outer(v, v) * to_500dpi for v in (m.x, m.y)))
        np.fill_diagonal(between, np.inf)
        found["spacing_px"] += between.min(axis=1).tolist()
        found["neighbours"] += (between < NEAR_PX).sum(axis=1).tolist()
        found["flow_deg"] += _off_flow(template).tolist()
    return {k: np.array(v)[~np.isnan(v)] for k, v in found.items() if v}


def _off_flow(template: Template) -> NDArray[np.float64]:
    """Return the angle between each minutia's direction and the ridges of its cell, 0 to 90°."""
    m, field = template.minutiae, template.field
    assert field is not None
    last = np.array(field.mask.shape) - 1
    row, column = (
        np.clip((v / field.step).astype(int), 0, end)
        for v, end in zip((m.y, m.x), last, strict=True)
    )
    inside = field.mask[row, column]
    off = np.mod(m.angle - field.orientation[row, column] + np.pi / 2, np.pi) - np.pi / 2
    return np.asarray(np.degrees(np.abs(off[inside])), np.float64)


def _of_mates(group: Group, prepared: Sequence[PreparedTemplate]) -> dict[str, NDArray[np.float64]]:
    """Return what the mates of a group have in common."""
    size = len(prepared)
    mates = [
        (a, b)
        for a in range(size)
        for b in range(a + 1, size)
        if group.finger[a] == group.finger[b]
    ]
    chosen = mates[:: max(1, len(mates) // MOST_MATES)]
    names = "paired", "overlap", "place_px", "direction_deg", "kind", "ridges", "mated"
    found: dict[str, list[float]] = {name: [] for name in names}
    for a, b in chosen:
        result = MATCHER.compare(prepared[a], prepared[b])
        found["mated"].append(result.similarity)
        if result.similarity < LEAST_SIMILARITY or result.transform is None:
            continue
        compared = MATCHER.compared(prepared[a], prepared[b], result)
        one, other = (
            group.templates[k].minutiae.take(i) for k, i in zip((a, b), result.pairs.T, strict=True)
        )
        zoom = STANDARD_DPI / group.templates[b].dpi
        off = np.hypot(*(result.transform.apply(one.xy) - other.xy).T) * zoom
        # on screen, the transform's rotation is clockwise
        turned = one.angle - result.transform.rotation - other.angle
        turned = np.degrees(np.abs(np.mod(turned + np.pi, 2 * np.pi) - np.pi))
        found["place_px"] += off.tolist()
        found["direction_deg"] += turned.tolist()
        found["kind"].append(float((one.kind == other.kind).mean()))
        found["paired"].append(result.agreement)
        found["overlap"].append(result.overlap)
        if compared is not None and compared.ridge_agreement is not None:
            found["ridges"].append(compared.ridge_agreement)
    return {name: np.array(values) for name, values in found.items()}
