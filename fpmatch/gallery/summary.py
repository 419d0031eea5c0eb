"""Counts and sizes of a gallery."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa

from fpmatch.gallery.tables import ENTRY, FAILURE, GALLERY

if TYPE_CHECKING:
    from fpmatch.gallery.gallery import Gallery


@dataclass(frozen=True, slots=True)
class GallerySummary:
    """Hold counts and sizes of a gallery; `dpi` counts impressions by resolution."""

    version: int
    impressions: int
    subjects: int
    minutiae: int
    template_bytes: int
    dpi: dict[float, int]
    failures: int

    def as_dict(self) -> dict[str, Any]:
        """Return the JSON values that ``fpmatch gallery info --json`` prints."""
        by_dpi = [{"dpi": dpi, "impressions": count} for dpi, count in self.dpi.items()]
        return asdict(self) | {"dpi": by_dpi}


def summarise(gallery: Gallery) -> GallerySummary:
    """Count what is in a gallery."""
    by_dpi = sa.select(ENTRY.c.dpi, sa.func.count()).group_by(ENTRY.c.dpi).order_by(ENTRY.c.dpi)
    totals = sa.select(
        sa.func.count(),
        sa.func.count(ENTRY.c.subject.distinct()),
        sa.func.coalesce(sa.func.sum(ENTRY.c.minutiae), 0),
        sa.func.coalesce(sa.func.sum(sa.func.length(ENTRY.c.template)), 0),
    ).select_from(ENTRY)
    with gallery.database.reading() as connection:
        version = connection.scalar(sa.select(GALLERY.c.version))
        impressions, subjects, minutiae, size = map(int, connection.execute(totals).one())
        dpi = {float(row[0]): int(row[1]) for row in connection.execute(by_dpi)}
        failures = connection.scalar(sa.select(sa.func.count()).select_from(FAILURE))
    return GallerySummary(
        int(version or 0), impressions, subjects, minutiae, size, dpi, int(failures or 0)
    )
