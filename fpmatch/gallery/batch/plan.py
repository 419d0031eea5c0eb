"""The pairs that `fpmatch score` compares: their order and chunks."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Protocol

import numpy as np

from fpmatch.gallery.batch.pair_list import PrintNames, iterate_pairs, number_pairs

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class PairChunk:
    """Some pairs, as numbers of prints of the two sides; shape (N,) each.

    `genuine` is 1, 0 or -1 (unknown) where a list states it.
    """

    probe: NDArray[np.int32]
    reference: NDArray[np.int32]
    genuine: NDArray[np.int8] | None = None

    def __len__(self) -> int:
        return int(self.probe.size)


class Plan(Protocol):
    """The pairs to score, in chunks; different pairs have a different `identity`.

    `probes` and `references` are the numbers of the prints in these pairs, ascending.
    """

    identity: str
    number_of_chunks: int
    probes: Sequence[int]
    references: Sequence[int]

    def __len__(self) -> int:
        """Return the number of pairs."""

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs in their order, from chunk number `start` on."""


class AllPairs:
    """All probes with all references, which come in bands.

    Every probe is compared with the first band, one probe after the other, then every probe with
    the next. Each reference is thus prepared once, and only the templates of a band and of some
    probes are in memory.
    """

    def __init__(
        self, probes: int, references: int, *, band: int = 256, pairs_per_chunk: int = 4096
    ) -> None:
        self.probes: Sequence[int] = range(probes)
        self.references: Sequence[int] = range(references)
        self._band = max(1, min(band, references))
        self._block = -(-pairs_per_chunk // self._band)
        self._blocks = -(-probes // self._block)
        self.number_of_chunks = self._blocks * -(-references // self._band)
        self.identity = f"all of {probes} x {references} in {self._band} x {self._block}"

    def __len__(self) -> int:
        return len(self.probes) * len(self.references)

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs, as `Plan` says."""
        for number in range(start, self.number_of_chunks):
            band, block = divmod(number, self._blocks)
            reference = _span(band, self._band, len(self.references))
            probe = _span(block, self._block, len(self.probes))
            yield PairChunk(np.repeat(probe, reference.size), np.tile(reference, probe.size))


class ListedPairs:
    """The pairs of a list, in its order.

    The module `pair_list` describes it; `probes` and `references` are the names of the prints.
    Raises a `ScoringError` if the list cannot be read, is empty, or names a print that is not
    there.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        probes: PrintNames,
        references: PrintNames,
        *,
        pairs_per_chunk: int = 512,
    ) -> None:
        self._size = pairs_per_chunk
        listed = number_pairs(path, iterate_pairs(path), probes, references)
        self._pairs = listed.prints
        self._genuine = listed.genuine if (listed.genuine >= 0).any() else None
        self.number_of_chunks = -(-len(self._pairs) // pairs_per_chunk)
        self.probes: Sequence[int] = np.unique(self._pairs[:, 0]).tolist()
        self.references: Sequence[int] = np.unique(self._pairs[:, 1]).tolist()
        content = self._pairs.tobytes()
        content += b"" if self._genuine is None else self._genuine.tobytes()
        digest = hashlib.sha256(content).hexdigest()
        self.identity = f"listed {digest} by {pairs_per_chunk}"

    def __len__(self) -> int:
        return len(self._pairs)

    def chunks(self, start: int = 0) -> Iterator[PairChunk]:
        """Yield the pairs, as `Plan` says."""
        for k in range(start * self._size, len(self._pairs), self._size):
            probe, reference = self._pairs[k : k + self._size].T
            yield PairChunk(
                probe,
                reference,
                None if self._genuine is None else self._genuine[k : k + self._size],
            )


def find_identical_pairs(
    plan: Plan, probes: Mapping[int, bytes], references: Mapping[int, bytes], most: int
) -> tuple[int, list[tuple[int, int]]]:
    """Return how many pairs of a plan have the same digest on both sides, and the first of them.

    `probes` and `references` are the digests of prints by number. All pairs are counted by groups
    of prints with one digest, never one by one.
    """
    of_digest: dict[bytes, list[int]] = {digest: [] for digest in probes.values()}
    for number, digest in references.items():
        if digest in of_digest:
            of_digest[digest].append(number)
    partners = {probe: of_digest[digest] for probe, digest in probes.items() if of_digest[digest]}
    if not partners:
        return 0, []
    if isinstance(plan, AllPairs):
        pairs = ((i, j) for i in sorted(partners) for j in partners[i])
        return sum(map(len, partners.values())), list(islice(pairs, most))
    identical = [
        pair
        for chunk in plan.chunks()
        for pair in zip(chunk.probe.tolist(), chunk.reference.tolist(), strict=True)
        if pair[0] in partners and references.get(pair[1]) == probes[pair[0]]
    ]
    return len(identical), identical[:most]


def _span(number: int, size: int, end: int) -> NDArray[np.int32]:
    return np.arange(number * size, min((number + 1) * size, end), dtype=np.int32)
