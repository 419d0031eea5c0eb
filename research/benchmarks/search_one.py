#!/usr/bin/env python3
"""Search for one probe with one thread and with several: time of `fpmatch identify`, by kind.

    .venv/bin/python research/benchmarks/search_one.py --keep FOLDER [--prints 10000] [--workers 2]

The gallery has synthetic prints of different fingers (`made_gallery.py`); they and its database are
kept in FOLDER. Probes of other fingers are searched for, one after the other: with all prints
compared, and in stages by an index. Numbers of threads take turns; wall times are the best of all
rounds. The cores must be idle for it: the load of the machine is printed.

Where they are not, processor times of one thread say what idle cores would do: threads share the
part during which the interpreter's lock is released, and take turns with the rest. The second ratio
is of these. The exit status is 1 where candidates differ.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from contextlib import ExitStack
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

from made_gallery import PART, SEED, sensor_of, template_of, template_rows

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index import segment
from fpmatch.gallery.index.prints import compare, ridge_samples, stored_columns
from fpmatch.gallery.index.prints.stored_descriptors import StoredDescriptors
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.indexed import IndexedSearch
from fpmatch.gallery.search.opening import open_search
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.prints import bit_descriptors

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.search.search import Search
    from fpmatch.templates.minutiae import Template

RELEASING = (  # nearly all of their time is spent in kernels that release the lock
    (compare, "_fill"),
    (StoredDescriptors, "scores"),
    (segment, "count_votes"),
    (bit_descriptors, "encode_neighbours"),
    (bit_descriptors, "encode_orientations"),
    (ridge_samples, "restore"),
    (stored_columns, "read_columns"),
    (stored_columns, "read_cells"),
)
BATCH = 1000  # entries a transaction
LOSS = 0.01
LOSSES = {"all": 0.0, "index": LOSS}  # the last of galleries of more than 20,000 prints


def fill(gallery: Gallery, folder: Path, prints: int) -> None:
    """Enrol the synthetic prints that a gallery lacks."""
    for first in range(len(gallery), prints, BATCH):
        numbers = range(first, min(first + BATCH, prints))
        rows = {part: template_rows(folder, part) for part in {k // PART for k in numbers}}
        gallery.add(
            [
                NewEntry(
                    Label(str(k)),
                    f"{k}.tif",
                    k.to_bytes(32, "big"),
                    template_of(rows[k // PART], k % PART),
                )
                for k in numbers
            ]
        )


def measure(
    search: Search, probes: Sequence[Template], counts: Sequence[int], rounds: int, given: Any
) -> tuple[dict[int, float], bool]:
    """Return the wall time of a search by numbers of threads, and whether all found the same."""
    best = dict.fromkeys(counts, float("inf"))
    found = set()
    for _ in range(rounds):
        for workers in counts:
            start = time.perf_counter()
            results = [identify(search, probe, workers=workers, **given) for probe in probes]
            best[workers] = min(best[workers], (time.perf_counter() - start) / len(probes))
            found.add(repr(results))
    return best, len(found) == 1


def processor_times(
    search: Search, probes: Sequence[Template], rounds: int, given: Any
) -> tuple[float, float]:
    """Return processor time of a search by one thread: all, and what kernels release the lock."""
    spent = 0.0

    def timed(function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def call(*values: Any) -> Any:
            nonlocal spent
            start = time.thread_time()
            found = function(*values)
            spent += time.thread_time() - start
            return found

        return call

    best = float("inf"), 0.0
    with ExitStack() as stack:
        for owner, name in RELEASING:
            stack.enter_context(patch.object(owner, name, timed(getattr(owner, name))))
        for _ in range(rounds):
            spent, start = 0.0, time.process_time()
            for probe in probes:
                identify(search, probe, workers=1, **given)
            best = min(best, (time.process_time() - start, spent))
    return best[0] / len(probes), best[1] / len(probes)


def main() -> int:
    """Run the script; return its exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--keep", type=Path, required=True, help="folder of the gallery")
    parser.add_argument("--prints", type=int, default=10_000)
    parser.add_argument("--probes", type=int, default=4)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kinds", nargs="+", choices=LOSSES, default=list(LOSSES))
    given = parser.parse_args()
    numbers = range(given.probes)
    probes = [t for k in numbers for t in make_templates(SEED + 1, [k], sensors=[sensor_of(k)])]
    given.keep.mkdir(parents=True, exist_ok=True)
    same = True
    with open_gallery(given.keep / f"gallery-{given.prints}.db", create=True) as gallery:
        fill(gallery, given.keep, given.prints)
        for kind in given.kinds:
            options = {"loss": LOSSES[kind]}
            search = open_search(gallery, **options)
            if kind == "index" and not isinstance(search, IndexedSearch):
                continue  # so small a gallery has none
            first = identify(search, probes[0], workers=1, **options)
            times, alike = measure(search, probes, [1, given.workers], given.rounds, options)
            same &= alike
            one, several = times.values()
            whole, released = processor_times(search, probes, given.rounds, options)
            least = whole - released + released / given.workers
            print(
                f"{given.prints:,} prints, {kind:<6}{first.compared:>7,} compared: "
                f"{1e3 * one:.1f} ms by 1 thread, {1e3 * several:.1f} ms by {given.workers}: "
                f"{one / several:.2f} times as fast (load {os.getloadavg()[0]:.1f}); "
                f"processor {1e3 * whole:.1f} ms, {1e3 * released:.1f} without the lock: on idle "
                f"cores {1e3 * least:.1f} ms at least, {whole / least:.2f} times as fast"
                f"{'' if alike else '; THE CANDIDATES DIFFER'}",
                flush=True,
            )
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
