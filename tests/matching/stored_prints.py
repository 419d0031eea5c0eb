"""Templates of synthetic prints, stored small: 120 fingers, no two prints of one finger.

They are the first impressions of every other finger of the eight databases that
`research.synthetic_sets` makes from seed 601 on, 30 fingers each; positions in eighths
of a pixel, directions in 2048ths of a turn, ridge orientations in 256ths of half a turn.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from fpmatch.minutiae import Minutiae, RidgeField, Template

FILE = Path(__file__).with_name("data") / "synthetic_prints.npz"
STEP_PX = 16.0


@cache
def stored_prints() -> list[Template]:
    """Return all of them, with their ridges."""
    with np.load(FILE) as stored:
        column = dict(stored)
    found, cell, octet = [], 0, 0
    for k, (width, height, rows, columns) in enumerate(column["size"].tolist()):
        x, y, angle, kind, quality = (
            column["minutiae"][slice(*column["minutiae_start"][k : k + 2])].astype(float).T
        )
        octets = -(-rows * columns // 8)
        bits = np.unpackbits(column["mask"][octet : octet + octets], count=rows * columns)
        mask = bits.reshape(rows, columns).astype(bool)
        own = slice(cell, cell + int(mask.sum()))
        octet, cell = octet + octets, own.stop
        orientation, ridges = np.zeros(mask.shape, np.float32), np.zeros(mask.shape, np.uint64)
        orientation[mask] = column["orientation"][own] * (np.pi / 256)
        ridges[mask] = column["ridges"][own]
        minutiae = Minutiae(x / 8, y / 8, angle * (np.pi / 1024), kind, quality)
        field = RidgeField(STEP_PX, orientation, mask, ridges)
        found.append(Template(minutiae, width, height, field=field))
    return found
