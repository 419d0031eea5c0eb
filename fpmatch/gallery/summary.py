"""A gallery in figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import sqlalchemy as sa

from fpmatch.gallery.tables import ENTRY, FAILURE, GALLERY

if TYPE_CHECKING:
    from fpmatch.gallery.gallery import Gallery


@dataclass(frozen=True, slots=True)
class GallerySummary:
    """Hold a gallery in figures.

    Parameters
    ----------
    version : int
        Version of its form.
    impressions, subjects : int
        How many are enrolled, and of how many subjects.
    minutiae : int
        Minutiae of all templates.
    template_bytes : int
        Bytes of all templates.
    dpi : dict of int
        Number of impressions by resolution.
    failures : int
        Pictures that could not be enrolled.
    """

    version: int
    impressions: int
    subjects: int
    minutiae: int
    template_bytes: int
    dpi: dict[float, int]
    failures: int


def summarise(gallery: Gallery) -> GallerySummary:
    """Count what a gallery holds.

    Raises
    ------
    GalleryError
        If it cannot be read.
    """
    bytes_of_template = sa.func.length(ENTRY.c.template)
    by_dpi = sa.select(ENTRY.c.dpi, sa.func.count()).group_by(ENTRY.c.dpi).order_by(ENTRY.c.dpi)
    with gallery.place.reading() as connection:
        version = connection.scalar(sa.select(GALLERY.c.version))
        count, subjects, minutiae, size = connection.execute(
            sa.select(
                sa.func.count(),
                sa.func.count(ENTRY.c.subject.distinct()),
                sa.func.sum(ENTRY.c.minutiae),
                sa.func.sum(bytes_of_template),
            ).select_from(ENTRY)
        ).one()
        dpi = {float(row[0]): int(row[1]) for row in connection.execute(by_dpi)}
        failures = connection.scalar(sa.select(sa.func.count()).select_from(FAILURE))
    return GallerySummary(
        version=int(version or 0),
        impressions=count,
        subjects=subjects,
        minutiae=int(minutiae or 0),
        template_bytes=int(size or 0),
        dpi=dpi,
        failures=int(failures or 0),
    )
