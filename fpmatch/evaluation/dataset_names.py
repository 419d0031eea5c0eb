"""Names by which databases side by side can be told apart."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.dataset import Dataset


def named_apart(datasets: Sequence[Dataset]) -> list[Dataset]:
    """Return databases whose names all differ: where one comes twice, the folder's name instead.

    Parameters
    ----------
    datasets : sequence of Dataset
        Databases as they were loaded.

    Returns
    -------
    list of Dataset
        The same, some renamed.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fpmatch.evaluation.dataset import Dataset, Impression
    >>> def of(folder, name):
    ...     return Dataset(name, None, "", (Impression(1, 1, Path(folder, "1_1.tif")),))
    >>> [d.name for d in named_apart([of("a", "x"), of("b", "x"), of("c", "y")])]
    ['a', 'b', 'y']
    """
    count = Counter(dataset.name for dataset in datasets)
    return [
        replace(dataset, name=dataset.impressions[0].path.resolve().parent.name)
        if count[dataset.name] > 1
        else dataset
        for dataset in datasets
    ]
