"""The part of a scoring that engines do: compare the pairs of a chunk."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.evaluation.scoring_sides import unpack

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.evaluation.scoring_plan import PairChunk
    from fpmatch.matching.result import Matcher

PREPARED_HELD: Final = 1024  # templates that a worker keeps prepared, those used last


@dataclass(frozen=True, slots=True)
class ComparisonTask:
    """Hold the pairs of a chunk with the templates they need, in bytes; failed prints have none."""

    pairs: PairChunk
    probes: Mapping[int, bytes]
    references: Mapping[int, bytes]


@dataclass(slots=True)
class Bench:
    """Hold the matcher, and what it prepared of the templates it met last."""

    matcher: Matcher
    prepared: OrderedDict[bytes, Any] = field(default_factory=OrderedDict)

    def prepare(self, data: bytes) -> Any:
        """Return a template, prepared."""
        if data in self.prepared:
            self.prepared.move_to_end(data)
            return self.prepared[data]
        prepared = self.prepared[data] = self.matcher.prepare(unpack(data))
        if len(self.prepared) > PREPARED_HELD:
            self.prepared.popitem(last=False)
        return prepared


def compare_pairs(bench: Bench, task: ComparisonTask) -> NDArray[np.float64]:
    """Return the similarity of each pair; not a number where a print has no template."""
    probes = {number: bench.prepare(data) for number, data in task.probes.items()}
    references = {number: bench.prepare(data) for number, data in task.references.items()}
    similarity = np.full(len(task.pairs), np.nan)
    pairs = zip(task.pairs.probe.tolist(), task.pairs.reference.tolist(), strict=True)
    for row, (probe, reference) in enumerate(pairs):
        if probe in probes and reference in references:
            comparison = bench.matcher.compare(probes[probe], references[reference])
            similarity[row] = comparison.similarity
    return similarity
