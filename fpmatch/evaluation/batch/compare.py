"""The part of a scoring that engines do: compare the pairs of a chunk."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.evaluation.batch.sources import unpack

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.evaluation.batch.plan import PairChunk
    from fpmatch.matching.result import Matcher

PREPARED_HELD: Final = 512  # templates that a worker keeps prepared, those used last


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
    _prepared: OrderedDict[bytes, Any] = field(default_factory=OrderedDict)
    _packed: tuple[list[bytes], Any] = ([], None)

    def prepare(self, data: bytes) -> Any:
        """Return a template, prepared."""
        if data in self._prepared:
            self._prepared.move_to_end(data)
            return self._prepared[data]
        prepared = self._prepared[data] = self.matcher.prepare(unpack(data))
        if len(self._prepared) > PREPARED_HELD:
            self._prepared.popitem(last=False)
        return prepared

    def pack(self, templates: list[bytes]) -> Any:
        """Return many templates, prepared and packed for the matcher's `similarities`."""
        if self._packed[0] != templates:
            from fpmatch.matching.packed_templates import PackedTemplates  # noqa: PLC0415

            self._packed = templates, PackedTemplates.pack(map(self.prepare, templates))
        return self._packed[1]


def compare_pairs(bench: Bench, task: ComparisonTask) -> NDArray[np.float64]:
    """Return the similarity of each pair; not a number where a print has no template.

    Where a probe meets all the references of the chunk, it is compared with them at once if the
    matcher can do that: its `similarities` finds what `compare` finds, to the last bit.
    """
    similarity = np.full(len(task.pairs), np.nan)
    there = np.isin(task.pairs.reference, list(task.references))
    numbers = sorted(task.references)
    for probe, data in task.probes.items():
        rows = np.flatnonzero((task.pairs.probe == probe) & there)
        met = task.pairs.reference[rows].tolist()
        if met == numbers and hasattr(bench.matcher, "similarities"):
            packed = bench.pack([task.references[number] for number in numbers])
            similarity[rows] = bench.matcher.similarities(bench.prepare(data), packed)
        else:
            similarity[rows] = [
                bench.matcher.compare(
                    bench.prepare(data), bench.prepare(task.references[number])
                ).similarity
                for number in met
            ]
    return similarity
