"""A print in a database, and the numbers of the fingers of prints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.base.printable import csv_cell
from fpmatch.image.dataset_folder import natural_key

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, order=True)
class Impression:
    """The file of one print, its finger, and which impression of the finger it is.

    In a database the fingers are all numbers, as in FVC's names, or all names. `name` is the
    print's in the database, by default the file's, as `csv_cell` makes it; `dpi` its own
    resolution, where a list states it; and `entry` its number in a gallery.
    """

    finger: int | str
    number: int
    path: Path
    name: str = ""
    dpi: float | None = None
    entry: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", csv_cell(self.name or self.path.name))


def finger_numbers(impressions: Sequence[Impression]) -> NDArray[np.intp]:
    """Return the fingers of impressions, numbered from 0 by number or name."""
    fingers = [one.finger for one in impressions]
    order = {f: k for k, f in enumerate(sorted(set(fingers), key=lambda f: natural_key(str(f))))}
    return np.array([order[finger] for finger in fingers], np.intp)
