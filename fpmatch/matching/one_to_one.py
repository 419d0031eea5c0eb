"""Two prints compared: what is kept of each, and the room that is used again for the next two."""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from fpmatch.matching import score
from fpmatch.matching._align_kernel import LightTable
from fpmatch.matching._one_to_one_kernel import OneToOne
from fpmatch.matching.align import AlignmentParameters
from fpmatch.matching.codes import sieve
from fpmatch.matching.local import LocalParameters, index_neighbours

if TYPE_CHECKING:
    from fpmatch.matching._evidence_kernel import Scales
    from fpmatch.matching._local_kernel import NeighbourIndex
    from fpmatch.matching._print_kernel import Print
    from fpmatch.matching.prepare import PreparedTemplate

PRINTS_KEPT: Final = 64
"""Prints of which is kept what the kernels want: a fifth of a megabyte each, the latest used."""

LEAST_ROOM: Final = 64


class Bench:
    """Lay prints on one another, two at a time; for one thread.

    Parameters
    ----------
    room : int
        The most minutiae of a print.
    on : Scales, optional
        What weighs (default: with the weights in the package).

    Attributes
    ----------
    table : LightTable
        Keeps the best alignment of the two prints laid last.
    scales : Scales
        Have its evidence.
    """

    def __init__(self, room: int, on: Scales | None = None) -> None:
        local = LocalParameters()
        self.room = room
        self.weights = score.load_weights()
        self.table = LightTable(room, room, local.seeds, AlignmentParameters())
        self.scales = score.scales(room, self.weights) if on is None else on
        self._kernel = OneToOne(sieve(), self.table, self.scales, room, local)

    def dismiss(
        self, probe: PreparedTemplate, reference: PreparedTemplate, *, reference_first: bool
    ) -> float | None:
        """Tell from their codes whether two prints have too little in common to be laid.

        Parameters
        ----------
        probe, reference : PreparedTemplate
            The two; it is quickest with one probe after the other.
        reference_first : bool
            Whether the reference comes first, by their content.

        Returns
        -------
        float or None
            The sum that stands for such prints; None where they are to be laid on one another.
        """
        lacking: float = self._kernel.lacking(
            for_kernels(probe), for_kernels(reference), reference_first
        )
        return self.scales.dismissed(lacking) if lacking > 0.0 else None

    def lay(self, a: PreparedTemplate, b: PreparedTemplate) -> float | None:
        """Lay print A on print B, in the order of their content.

        Returns
        -------
        float or None
            The weighted sum of the features; None where nothing of them is alike.
        """
        total: float = self._kernel.lay(_index_of(a), for_kernels(a), for_kernels(b))
        return total if self.table.best_pairs else None


_OWN: Final = threading.local()


def bench_for(minutiae: int) -> Bench:
    """Return the thread's own bench, with room for prints of so many minutiae."""
    bench: Bench | None = getattr(_OWN, "bench", None)
    if bench is None or bench.room < minutiae or bench.weights is not score.load_weights():
        room = max(LEAST_ROOM, 1 << (minutiae - 1).bit_length())
        bench = _OWN.bench = Bench(room)
    return bench


@lru_cache(maxsize=PRINTS_KEPT)
def for_kernels(print_: PreparedTemplate) -> Print:
    """Return a print as the kernels see it."""
    return print_.for_kernels()


@lru_cache(maxsize=PRINTS_KEPT)
def _index_of(print_: PreparedTemplate) -> NeighbourIndex:
    # threads share it, scratch and all, for the kernel above does not let go of Python's lock
    return index_neighbours(print_.neighbourhoods, LocalParameters(), comes_first=True)
