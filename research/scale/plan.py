"""The plan of a gallery on many machines: shards, replicas, times and costs."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.fingers.fused_fingers import fuse_fingers
from fpmatch.gallery.index.print_segment import MOST_PRINTS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from research.scale.constants import Assumptions, Constants

HOURS: Final = 730.0  # of a month
SEARCHES: Final = {10_000_000: 10.0, 100_000_000: 50.0, 1_000_000_000: 200.0}
"""Assumed searches a second, by the prints of a gallery."""
FPIR: Final = 0.01
MAX_SCORE: Final = 100
MOST_SHARDS: Final = 100_000
MAPPED_FILES: Final = 65_530.0  # vm.max_map_count


@dataclass(frozen=True, slots=True)
class Plan:
    """The machines for a gallery; a replica of a shard is a machine.

    Times are seconds, of all cores of a machine where `core_hours` does not say otherwise.
    """

    prints: int
    searches_s: float
    shards: int
    replicas: int
    service_s: float  # of one search in one shard
    utilisation: float
    whole_s: float  # processor time of a search on one core, if one machine could hold all
    fan_out: float  # processor time of a search in all shards over that
    memory_gb: float  # of one replica of all
    database_gb: float
    enrol_core_hours: float
    index_core_hours: float
    load_s: float  # a shard, from its machine's disk
    copy_s: float  # a shard, from another replica over the network, and its check
    rebuild_s: float  # a shard, from the database
    month: float  # price of machines and storage
    thousand_searches: float  # price, at this utilisation

    @property
    def machines(self) -> int:
        """Number of machines."""
        return self.shards * self.replicas

    def as_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        return {**asdict(self), "machines": self.machines}


def make_plan(prints: int, searches_s: float, c: Constants, a: Assumptions) -> Plan:
    """Return the plan with the fewest machines; of equals, that of the shortest search."""
    room = a.memory_gb * 1e9 * a.memory_share / c.print_bytes
    least = math.ceil(prints / room)
    together = a.cores * a.efficiency
    best: tuple[int, float, int, int] | None = None
    shards = least
    while shards <= max(MOST_SHARDS, least):
        service = c.search_s(prints / shards) / together
        replicas = max(a.replicas, math.ceil(searches_s * service / a.utilisation))
        found = (shards * replicas, service, shards, replicas)
        if best is None or found < best:
            best = found
        elif shards * a.replicas > best[0]:
            break
        shards += max(1, shards // 20)
    assert best is not None
    machines, service, shards, replicas = best
    shard = prints / shards
    shard_mb = shard * c.print_bytes / 1e6
    database_gb = prints * c.database_bytes / 1e9
    month = machines * a.cores * HOURS * a.core_hour
    month += (database_gb + machines * shard_mb / 1e3) * a.gb_month
    whole = c.search_s(prints)
    return Plan(
        prints=prints,
        searches_s=searches_s,
        shards=shards,
        replicas=replicas,
        service_s=service,
        utilisation=searches_s * service / replicas,
        whole_s=whole,
        fan_out=shards * service * together / whole,
        memory_gb=prints * c.print_bytes / 1e9,
        database_gb=database_gb,
        enrol_core_hours=prints * c.enrol_us / 3.6e9,
        index_core_hours=prints * c.rebuild_us / 3.6e9,
        load_s=shard_mb / a.disk_mb_s,
        copy_s=shard_mb / a.network_mb_s + shard_mb / a.disk_mb_s,
        rebuild_s=shard * (c.rebuild_us / together / 1e6 + c.database_bytes / a.disk_mb_s / 1e6),
        month=month,
        thousand_searches=1000 * month / (searches_s * HOURS * 3600),
    )


def threshold(prints: int) -> float:
    """Return the score that one search in a hundred without a mate exceeds by chance."""
    return -10.0 * math.log10(FPIR / prints)


def found_shares(prints: int, genuine: list[int]) -> tuple[float, float]:
    """Return the shares of genuine pairs, and of two of them fused, that reach the threshold.

    The two are drawn independently: fingers of one person are rather alike in quality, so that
    fewer are found in truth. Scores of a gallery of P subjects with two fingers each are compared
    with the threshold for P.
    """
    counts = np.array(genuine, float) / sum(genuine)
    score = np.arange(len(counts), dtype=float)
    needed = threshold(prints)
    one = float(counts[score >= needed].sum())
    pairs = np.stack(np.meshgrid(score, score), axis=-1)
    both = np.outer(counts, counts)
    subjects = threshold(max(1, prints // 2))
    return one, float(both[_fused(pairs) >= subjects].sum())


def _fused(pairs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the scores of two fingers by Fisher's rule, which may be over 100 here.

    ``q * (1 - ln q)`` is the rate at which the product of two rates is at most q.
    """
    exponent = pairs.sum(axis=-1) * (math.log(10.0) / 10.0)
    fused = pairs.sum(axis=-1) - 10.0 / math.log(10.0) * np.log1p(exponent)
    return np.where(fused < MAX_SCORE, fuse_fingers(pairs), fused)


def limits(c: Constants, a: Assumptions, measured_score: float) -> list[tuple[float, str, str]]:
    """Return the prints at which each limit is reached, ascending, with what it is and what then.

    `measured_score` is the largest one that the calibration has measured.
    """
    memory = a.memory_gb * 1e9 * a.memory_share / c.print_bytes
    day = 24 * 3600 / (c.enrol_us / 1e6)
    share = np.cumsum(c.genuine[::-1]) / sum(c.genuine)
    median = MAX_SCORE - int(np.searchsorted(share, 0.5))
    found = [
        (
            FPIR * 10 ** (median / 10),
            "half of the genuine pairs miss the threshold of an FPIR of 1 % (extrapolated)",
            "two fingers a search",
        ),
        (
            FPIR * 10 ** (measured_score / 10),
            "false match rates are extrapolated at an FPIR of 1 %",
            "measure on more impostor pairs; two fingers a search",
        ),
        (memory, "memory of one machine", "shards on several machines"),
        (
            FPIR * 10 ** (MAX_SCORE / 10),
            "scores end at 100: no threshold for an FPIR of 1 % with one finger",
            "two fingers a search; a longer scale of scores",
        ),
        (365 * day, "one writer at a time enrols so many in a year", "a database a shard"),
        (2.0**31, "numbers of entries on PostgreSQL have 32 bits", "BIGINT, or a database a shard"),
        (
            2.0**32 * 4096 / c.database_bytes,
            "SQLite's file: 2^32 pages of 4,096 bytes",
            "larger pages, or a database a shard",
        ),
        (
            MOST_PRINTS * MAPPED_FILES,
            f"{MOST_PRINTS:,} prints a segment, and so many files mapped by a process (Linux)",
            "shards on several machines",
        ),
    ]
    return sorted(found)
