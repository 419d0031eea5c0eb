"""The similarities of all pairs of some templates, by the default matcher's 1:N comparison."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.packed_templates import PackedTemplates

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.minutiae import Template


def compare_all_pairs(
    templates: Sequence[Template], *, workers: int | None = None
) -> NDArray[np.float64]:
    """Compare each template with every later one.

    Parameters
    ----------
    templates : sequence of Template
        N templates.
    workers : int, optional
        Threads to use (default: one a core). The similarities are the same for any number.

    Returns
    -------
    ndarray of float64, shape (N * (N - 1) / 2,)
        The similarities that `compare` of the default matcher returns, in the order of
        ``numpy.triu_indices(N, 1)``, which is that of the extended protocol.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> minutiae = Minutiae(x=[50, 90, 60, 70], y=[40, 50, 80, 60], angle=[0, 1, 2, 3])
    >>> full, empty = (Template(m, 100, 100) for m in (minutiae, Minutiae.empty()))
    >>> found = compare_all_pairs([full, empty, full])
    >>> (found > 0).tolist()
    [False, True, False]
    """
    prints = [MATCHER.prepare(template) for template in templates]
    many = PackedTemplates.pack(prints)

    def with_later_ones(k: int) -> NDArray[np.float64]:
        return MATCHER.similarities(prints[k], many, k + 1)

    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        return np.concatenate([np.empty(0), *pool.map(with_later_ones, range(len(prints)))])
