"""The plan of a gallery on many machines: shards, replicas, times and costs."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from fpmatch.gallery.index.print_segment import MOST_PRINTS

if TYPE_CHECKING:
    from research.scale.constants import Assumptions, Constants

HOURS: Final = 730.0  # of a month
SEARCHES: Final = {10_000_000: 10.0, 100_000_000: 50.0, 1_000_000_000: 200.0}
"""Assumed searches a second, by the prints of a gallery."""
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


def limits(c: Constants, a: Assumptions) -> list[tuple[float, str, str]]:
    """Return the prints at which each limit is reached, ascending, the limit, and what then."""
    memory = a.memory_gb * 1e9 * a.memory_share / c.print_bytes
    day = 24 * 3600 / (c.enrol_us / 1e6)
    rows = [
        (memory, "memory of one machine", "shards on several machines"),
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
    return sorted(rows)
