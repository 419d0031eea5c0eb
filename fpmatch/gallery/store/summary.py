"""Counts and sizes of a gallery."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from fpmatch.gallery.listing.entry import GallerySummary
from fpmatch.gallery.store.tables import ENTRY, FAILURE, GALLERY
from fpmatch.templates.bounds import MOST_MINUTIAE
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI

if TYPE_CHECKING:
    from fpmatch.gallery.store.gallery import Gallery

_COUNT: Final = sa.func.count()
_SOUND: Final = sa.and_(
    ENTRY.c.dpi.between(MIN_DPI, MAX_DPI), ENTRY.c.minutiae.between(0, MOST_MINUTIAE)
)


def count_entries(gallery: Gallery) -> dict[str, Any]:
    """Return the counts that indices of the database contain, as JSON values.

    They have the names of a `GallerySummary`; no row of an entry is read.
    """
    with gallery.reading() as connection:
        sealing = gallery.sealing(connection)
        return {
            "version": connection.scalar(sa.select(GALLERY.c.version)),
            "impressions": connection.scalar(sa.select(_COUNT).select_from(ENTRY)),
            "subjects": connection.scalar(sa.select(sa.func.count(ENTRY.c.subject.distinct()))),
            "failures": connection.scalar(sa.select(_COUNT).select_from(FAILURE)),
            "keys": [] if sealing is None else [sealing.key_id],
        }


def summarize(gallery: Gallery) -> GallerySummary:
    """Return all counts and sizes; each row of an entry is read."""
    counted = count_entries(gallery)
    of_dpi = sa.select(ENTRY.c.dpi, _COUNT).group_by(ENTRY.c.dpi).order_by(ENTRY.c.dpi)
    totals = sa.select(
        _COUNT,
        sa.func.count(ENTRY.c.subject.distinct()),
        sa.func.coalesce(sa.func.sum(ENTRY.c.minutiae), 0),
        sa.func.coalesce(sa.func.sum(sa.func.length(ENTRY.c.template)), 0),
    )
    with gallery.reading() as connection:
        impressions, subjects, minutiae, size = map(
            int, connection.execute(totals.where(_SOUND)).one()
        )
        by_dpi = {float(dpi): count for dpi, count in connection.execute(of_dpi.where(_SOUND))}
    return GallerySummary(
        version=counted["version"],
        impressions=impressions,
        subjects=subjects,
        minutiae=minutiae,
        template_bytes=size,
        dpi=by_dpi,
        failures=counted["failures"],
        damaged=counted["impressions"] - impressions,
        keys=tuple(counted["keys"]),
    )
