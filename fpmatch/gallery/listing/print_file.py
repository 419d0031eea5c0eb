"""The file of a print, as a command was given it: where it is, and whose it is."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, replace
from itertools import count
from typing import TYPE_CHECKING

from fpmatch.gallery.listing.csv_rows import csv_cell

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.gallery.listing.entry import Label


@dataclass(frozen=True, slots=True)
class PrintFile:
    """The file of an image or a template, and its resolution (None: that in the file).

    `label` is that of a manifest, a pattern or the folders; None where only the file's name may
    contain one. `name` is the file's, or the path by which a manifest or a folder of folders has
    it, as `csv_cell` makes it. `place` is the folder above its own, or the manifest, from which it
    was taken.
    """

    path: Path
    dpi: float | None = None
    label: Label | None = None
    name: str = ""
    place: Path | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", csv_cell(self.name or self.path.name))


def resolution_notes(dpi: Sequence[float | None]) -> list[tuple[str, ...]]:
    """Return for each resolution a note where it is not that of most prints; None is unknown.

    Examples
    --------
    >>> resolution_notes([500.0, None, 1000.0, 500.0])
    [(), (), ('1000 dpi, where most prints have 500 dpi',), ()]
    """
    known = Counter(one for one in dpi if one is not None)
    if len(known) < 2:
        return [()] * len(dpi)
    usual = known.most_common(1)[0][0]
    note = "{:g} dpi, where most prints have {:g} dpi"
    return [() if one in {None, usual} else (note.format(one, usual),) for one in dpi]


def number_impressions(labels: Sequence[Label]) -> list[Label]:
    """Return labels of which those without an impression have got a number, in their order.

    Examples
    --------
    >>> from fpmatch.gallery.listing.entry import Label
    >>> [str(one) for one in number_impressions([Label("ada"), Label("ada", "", "1")])]
    ['ada_2', 'ada_1']
    """
    taken = set(labels)
    numbers: dict[Label, count[int]] = defaultdict(lambda: count(1))
    numbered = []
    for label in labels:
        one = label
        while not one.impression or (one is not label and one in taken):
            one = replace(label, impression=str(next(numbers[label.of_finger])))
        numbered.append(one)
    return numbered
