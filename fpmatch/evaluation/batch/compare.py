"""The work of engines in `fpmatch score`: the similarities of a chunk of pairs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.evaluation.batch.sources import unpack
from fpmatch.evaluation.comparison import Comparer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.evaluation.batch.plan import PairChunk
    from fpmatch.minutiae import Template


@dataclass(frozen=True, slots=True)
class ComparisonTask:
    """Hold the pairs of a chunk with the templates they need, in bytes; failed prints have none."""

    pairs: PairChunk
    probes: Mapping[int, bytes]
    references: Mapping[int, bytes]


class BytesComparer(Comparer[bytes]):
    """Compare templates that are kept as bytes."""

    def template(self, key: bytes) -> Template:
        """Return the template that the bytes hold."""
        return unpack(key)


def compare_pairs(comparer: BytesComparer, task: ComparisonTask) -> NDArray[np.float64]:
    """Return the similarity of each pair; not a number where a print has no template.

    A probe that is paired with all references of the chunk is compared with them at once.
    """
    similarity = np.full(len(task.pairs), np.nan)
    usable = np.isin(task.pairs.reference, list(task.references))
    every = sorted(task.references)
    packed = [task.references[number] for number in every]
    for probe, data in task.probes.items():
        rows = np.flatnonzero((task.pairs.probe == probe) & usable)
        numbers = task.pairs.reference[rows].tolist()
        if numbers == every:
            similarity[rows] = comparer.similarities(data, packed)
        else:
            references = [task.references[number] for number in numbers]
            similarity[rows] = comparer.one_by_one(data, references)
    return similarity
