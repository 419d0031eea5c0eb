"""What a plan is computed from: constants that were measured, and assumptions that are stated."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Mapping

STAGES: Final = ("unpack", "prepare", "terms", "embeddings", "descriptors", "compact")
"""Steps by which a stored template joins the index."""


@dataclass(frozen=True, slots=True)
class Constants:
    """Measured constants of one core and one print.

    `delaunay_us`: processor time of scipy's Delaunay triangulation of 40 points in the same run.
    `search`: prints of a gallery, and seconds of processor time of a search; at least two,
    ascending.
    """

    delaunay_us: float
    enrol_us: float  # of enrolling a template in a gallery on SQLite
    index_us: dict[str, float]  # of each of `STAGES`
    index_bytes: dict[str, float]  # bytes a print of the index by part
    database_bytes: float  # bytes a print of the database
    search: list[tuple[int, float]]

    @property
    def print_bytes(self) -> float:
        """Bytes of a print that a search needs in memory."""
        return sum(self.index_bytes.values())

    @property
    def rebuild_us(self) -> float:
        """Processor time of indexing a print of the database."""
        return sum(self.index_us.values())

    def search_s(self, prints: float) -> float:
        """Return the processor time of a search of some prints.

        Between measured numbers of prints it is a power of their number. Beyond them it grows with
        their number, as that of the first stage does, which visits all prints.
        """
        most, longest = self.search[-1]
        if prints > most:
            return longest * prints / most
        pairs = zip(self.search, self.search[1:], strict=False)
        (fewer, short), (more, long) = next(pair for pair in pairs if prints <= pair[1][0])
        exponent = math.log(long / short) / math.log(more / fewer)
        return float(short * (prints / fewer) ** exponent)

    @classmethod
    def from_dict(cls, document: Any) -> Constants:
        """Return the constants in a JSON document."""
        try:
            given = {f.name: document[f.name] for f in fields(cls)}
            given["search"] = [(int(n), float(s)) for n, s in given["search"]]
            made = cls(**given)
            numbers = [made.delaunay_us, made.enrol_us, made.database_bytes]
            numbers += [*made.index_us.values(), *made.index_bytes.values()]
            numbers += [value for pair in made.search for value in pair]
            counts = [prints for prints, _ in made.search]
            ascending = len(counts) > 1 and counts == sorted(set(counts))
            sound = ascending and all(0 < value < math.inf for value in numbers)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise FpmatchError(f"constants of a plan: {error!r}") from error
        if not sound:
            raise FpmatchError("constants of a plan: a number is impossible")
        return made


@dataclass(frozen=True, slots=True)
class Assumptions:
    """What is assumed of machines, requests and prices; none of it is measured."""

    cores: int = 16  # of a machine
    memory_gb: float = 64.0
    memory_share: float = 0.7  # that holds the index
    efficiency: float = 0.8  # of all cores together
    utilisation: float = 0.5  # at most, of a machine
    replicas: int = 2  # of each shard, at least
    disk_mb_s: float = 500.0
    network_mb_s: float = 1000.0
    network_ms: float = 0.5  # of a request and its answer
    front_ms: float = 1.0  # to prepare a probe and to merge the candidates
    spread: float = 0.3  # sd of the logarithm of the time of a search, over the probes
    jitter: float = 0.1  # the same, over the machines
    core_hour: float = 0.04  # price, in any currency
    gb_month: float = 0.02  # price of storage

    def as_dict(self) -> Mapping[str, float]:
        """Return all by name."""
        return asdict(self)
