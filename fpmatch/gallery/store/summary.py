"""Counts and sizes of a gallery."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

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

    They are a part of what `summarize` returns; no row of an entry is read.
    """
    sealing = gallery.sealing()
    return {
        "version": gallery.count(sa.select(GALLERY.c.version)),
        "impressions": len(gallery),
        "subjects": gallery.subjects(),
        "failures": gallery.count(sa.select(_COUNT).select_from(FAILURE)),
        "keys": [] if sealing is None else [sealing.key_id],
    }


def summarize(gallery: Gallery) -> dict[str, Any]:
    """Return all counts and sizes, as JSON values; each row of an entry is read.

    "damaged" is the number of entries that are not counted, as their numbers are impossible.
    """
    counted = count_entries(gallery)
    of_dpi = sa.select(ENTRY.c.dpi, _COUNT).group_by(ENTRY.c.dpi).order_by(ENTRY.c.dpi)
    totals = sa.select(
        _COUNT.label("impressions"),
        sa.func.count(ENTRY.c.subject.distinct()).label("subjects"),
        sa.func.coalesce(sa.func.sum(ENTRY.c.minutiae), 0).label("minutiae"),
        sa.func.coalesce(sa.func.sum(sa.func.length(ENTRY.c.template)), 0).label("template_bytes"),
    )
    with gallery.reading() as connection:
        row = connection.execute(totals.where(_SOUND)).one()
        by_dpi = connection.execute(of_dpi.where(_SOUND)).all()
    sizes = {name: int(number) for name, number in row._mapping.items()}
    return {
        "version": counted["version"],
        **sizes,
        "dpi": [{"dpi": float(dpi), "impressions": count} for dpi, count in by_dpi],
        "failures": counted["failures"],
        "damaged": counted["impressions"] - sizes["impressions"],
        "keys": counted["keys"],
    }
