"""A segment of an index: what a search needs of some prints, in the arrays of one file."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index import segment
from fpmatch.gallery.index.embedding import NETWORK_SHA256
from fpmatch.gallery.index.model import TERMS
from fpmatch.gallery.index.prints import compact_template, prepared_prints, stored_descriptors
from fpmatch.gallery.index.prints.compact_template import CompactTemplates, prepare_compact
from fpmatch.gallery.index.prints.compare import ridge_agreement
from fpmatch.gallery.index.prints.print_arrays import PRINT, START
from fpmatch.gallery.index.prints.stored_descriptors import StoredDescriptors
from fpmatch.gallery.index.segment import Segment
from fpmatch.gallery.store.array_file import Column
from fpmatch.matching.constants.comparison import SMALL_AREA_PX2

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.templates.minutiae import Template

MOST_PRINTS: Final = 4096
"""Prints of a segment of a gallery: a removal writes the whole segment anew."""
_SHARED: Final = {PRINT, START}


@dataclass(frozen=True, slots=True, eq=False)
class PrintSegment:
    """Some prints in the forms that the stages of a search need; numbers of entries ascend.

    The first needs terms, the second bit descriptors, the third both these and compact templates,
    the last compact templates.
    """

    terms: Segment
    descriptors: StoredDescriptors
    templates: CompactTemplates

    @classmethod
    def build(cls, prints: Sequence[tuple[int, int, Template, PreparedTemplate]]) -> PrintSegment:
        """Return a segment of entries: number, number of the finger, template, and prepared."""
        numbers = np.array([row[0] for row in prints], np.int64)
        fingers = np.array([row[1] for row in prints], np.int64)
        prepared = [row[3] for row in prints]
        return cls(
            Segment.build(numbers, fingers, prepared),
            StoredDescriptors.pack(prepared),
            CompactTemplates.pack(row[2] for row in prints),
        )

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> PrintSegment:
        """Return the segment in the arrays of a file.

        Raises MatcherError if a number would lead out of an array, or out of what is ever built.
        """
        parts = []
        for name, (kind, columns) in _PARTS.items():
            parts.append(kind.of_arrays({k: arrays[f"{name}_{k}"] for k in columns}))
        loaded = cls(*parts)
        sizes = {len(part) for part in parts}
        numbers = loaded.numbers
        if sizes != {len(numbers)} or not len(numbers) or (numbers[1:] <= numbers[:-1]).any():
            raise MatcherError("damaged", code="damaged")
        if not ((loaded.fingers > 0) & (loaded.fingers <= numbers)).all():
            raise MatcherError("damaged", code="damaged")
        return loaded

    @classmethod
    def concatenate(cls, parts: Sequence[PrintSegment]) -> PrintSegment:
        """Return the prints of all `parts`, whose numbers ascend, one after the other."""
        return cls(
            *(
                kind.concatenate([getattr(part, name) for part in parts])
                for name, (kind, _) in _PARTS.items()
            )
        )

    def take(self, which: NDArray[Any]) -> PrintSegment:
        """Return a copy of the prints with the places `which`, ascending."""
        runs = np.split(which, np.flatnonzero(np.diff(which) > 1) + 1) if len(which) else []
        bounds = [(int(run[0]), int(run[-1]) + 1) for run in runs]
        return PrintSegment(
            self.terms.take(which),
            StoredDescriptors.concatenate([self.descriptors.part(*each) for each in bounds]),
            CompactTemplates.concatenate([self.templates.part(*each) for each in bounds]),
        )

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays by name."""
        return {
            f"{name}_{k}": array
            for name in _PARTS
            for k, array in getattr(self, name).arrays().items()
        }

    @property
    def numbers(self) -> NDArray[Any]:
        """The numbers of the entries, shape (N,)."""
        return self.terms.number

    @property
    def fingers(self) -> NDArray[Any]:
        """The number of the finger of each, shape (N,)."""
        return self.terms.finger

    def __len__(self) -> int:
        return len(self.numbers)


def prepare_prints(
    segments: Sequence[PrintSegment], segment: NDArray[np.integer], place: NDArray[np.integer]
) -> PreparedPrints:
    """Return prints of some segments, prepared: the numbers of their segments, and their places."""
    (templates,), numbers = _gather(("templates",), segments, segment, place)
    return prepare_compact(templates, numbers)


def ridge_agreements(
    probe: PreparedTemplate,
    segments: Sequence[PrintSegment],
    segment: NDArray[np.integer],
    place: NDArray[np.integer],
) -> NDArray[np.float64]:
    """Return the `ridge_agreement` of a probe and of prints of some segments."""
    names = "descriptors", "templates"
    (descriptors, templates), numbers = _gather(names, segments, segment, place)
    return ridge_agreement(probe, descriptors, templates, numbers)


def _gather(
    names: Sequence[str],
    segments: Sequence[PrintSegment],
    segment: NDArray[np.integer],
    place: NDArray[np.integer],
) -> tuple[list[Any], NDArray[np.intp]]:
    """Return some parts of prints of some segments, and the number of each print in them."""
    order = np.argsort(segment, kind="stable")
    bounds = np.searchsorted(segment[order], np.arange(len(segments) + 1)).tolist()
    of_each = zip(segments, pairwise(bounds), strict=True)
    taken = [(one, place[order[a:b]]) for one, (a, b) in of_each if a < b]
    parts = [
        _PARTS[name][0].concatenate([getattr(one, name).take(some) for one, some in taken])
        for name in names
    ]
    return parts, np.argsort(order)


_PARTS: Final[dict[str, tuple[Any, Mapping[str, Column]]]] = {
    "terms": (Segment, segment.COLUMNS),
    "descriptors": (StoredDescriptors, stored_descriptors.COLUMNS),
    "templates": (CompactTemplates, compact_template.COLUMNS),
}


def _columns() -> dict[str, Column]:
    """Return the arrays of a file; dimensions have the names of their own part."""
    return {
        f"{name}_{k}": Column(
            column.dtype,
            tuple(d if isinstance(d, int) or d in _SHARED else f"{name}_{d}" for d in column.shape),
        )
        for name, (_, columns) in _PARTS.items()
        for k, column in columns.items()
    }


COLUMNS: Final = _columns()
"""The arrays of a file."""


def parameters() -> str:
    """Return the parameters on which the contents of the arrays depend."""
    whole = f"ridges whole up to {SMALL_AREA_PX2:g} px^2"
    network = f"network {NETWORK_SHA256[:16]}"
    return f"{prepared_prints.preparation()}; {TERMS} terms; {network}; {whole}"
