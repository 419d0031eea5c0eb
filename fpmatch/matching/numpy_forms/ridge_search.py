"""Numpy form of `_ridge_search_kernel`: the agreement of ridge orientation."""

from __future__ import annotations

from typing import Any

import numpy as np

from fpmatch.matching.numpy_forms.ridges import cells_of


@np.errstate(over="ignore", invalid="ignore")  # of transforms that lead nowhere
def flow_agreements(search: Any, small: Any, i: Any, large: Any, j: Any) -> list[float]:
    """Return how well the orientation agrees under the transforms that pairs fix, -1 to 1.

    -2 where the prints have too little in common.
    """
    near, far = np.asarray(small.points)[:, i, None], np.asarray(large.points)[:, j, None]
    c = near[2] * far[2] + near[3] * far[3]
    s = near[2] * far[3] - near[3] * far[2]
    shift_x = far[0] - c * near[0] + s * near[1]
    shift_y = far[1] - s * near[0] - c * near[1]
    place, flow = (
        np.asarray(of)[:, : search.samples] for of in (search.sample, search.sample_flow)
    )
    x = c * place[0] - s * place[1] + shift_x
    y = s * place[0] + c * place[1] + shift_y
    x = x * large.per_px - large.first_column
    y = -y * large.per_px - large.first_row
    common = (x >= 0.0) & (x < large.columns) & (y >= 0.0) & (y < large.rows)
    code = np.zeros(x.shape, np.intp)
    code[common] = cells_of(large)[y[common].astype(np.intp), x[common].astype(np.intp)]
    common &= code > 0
    turn_c, turn_s = c * c - s * s, 2.0 * c * s
    x = turn_c * flow[0] - turn_s * flow[1]
    y = turn_s * flow[0] + turn_c * flow[1]
    agreement = x * np.asarray(search.flow_c)[code] + y * np.asarray(search.flow_s)[code]
    count = common.sum(axis=1)
    if not search.samples:
        return [-2.0] * len(count)
    total = np.cumsum(np.where(common, agreement, 0.0), axis=1)[:, -1]
    enough = (count > 0) & (count >= search.least_common * search.samples)
    agreements: list[float] = np.where(enough, total / np.maximum(count, 1), -2.0).tolist()
    return agreements


def select(search: Any, small: Any, large: Any) -> int:
    """Keep the pairs under which the orientation agrees best; return their number."""
    search._take_samples(small)
    others = np.arange(large.size)
    for i in range(small.size):
        offer_all(search, small, np.full(large.size, i), large, others, large.size)
    return int(search.count)


def offer_all(search: Any, small: Any, own: Any, large: Any, other: Any, count: int) -> int:
    """Offer the first pairs of two lists of minutiae; return how many are kept in all."""
    i, j = np.asarray(own)[:count], np.asarray(other)[:count]
    flows = flow_agreements(search, small, i, large, j)
    for k, flow in enumerate(flows):
        if flow >= search.min_flow:
            search._keep(flow, i[k], j[k])
    return int(search.count)
