#!/usr/bin/env python3
"""Search for many probes: one process, two processes, and a Dask cluster of two local workers.

    .venv/bin/python research/benchmarks/search_many.py [--prints 10000] [--probes 64] [--rounds 5]

Candidate lists of disturbed sample prints in a gallery of others, written to a file as by
`fpmatch identify -o`. The workers are there before the clock starts; reading of the probes'
templates, comparison, ranking and the file are measured. Rounds of all three take turns; the ratio
is that of the best wall times. Two cores must be idle for it: the load of the machine is printed.

Where they are not, processor times say what two idle cores would do: they need at least half of
the processor time of all processes, and that of the busiest one. The second ratio is of these.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import tempfile
import time
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import psutil
from disturbed_prints import disturbed, sample_templates

from fpmatch.formats.files import save_template
from fpmatch.gallery.batch.candidates import write_candidates
from fpmatch.gallery.batch.sources import FolderSource
from fpmatch.gallery.engine.engine import dask, processes, serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.search.search import SearchOptions

if TYPE_CHECKING:
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.search.search import Search
    from fpmatch.templates.minutiae import Template

WARM_UP = 2  # probes of the first, short run of each engine
CORES = 2
BATCH = 1000  # entries a transaction


class Bench:
    """Search for the probes of a folder with one engine after the other."""

    def __init__(self, gallery: Gallery, search: Search, folder: Path, candidate_list: str) -> None:
        self._gallery, self._search, self._folder = gallery, search, folder
        size = int(candidate_list) if candidate_list.isdecimal() else candidate_list
        self._options = SearchOptions(listed="subjects", candidate_list=size)  # type: ignore[arg-type]

    def seconds(self, engine: Engine, probes: int | None = None) -> tuple[float, float, bytes]:
        """Return wall time of the searches, least time on two idle cores, and the file."""
        files = find_prints([self._folder])[:probes]
        source = FolderSource(self._folder, files, None, "auto", None)
        output = self._folder.parent / "candidates.csv"
        before, start = processor_times(), time.perf_counter()
        write_candidates(
            self._gallery, self._search, source, output, self._options, content="", engine=engine
        )
        taken = time.perf_counter() - start
        used = processor_times()
        used.subtract(before)
        least = max(*used.values(), sum(used.values()) / CORES, 0.0)
        return taken, least, output.read_bytes()


def entry(template: Template, number: int) -> NewEntry:
    """Return a disturbed template under a number."""
    content = hashlib.sha256(str(number).encode()).digest()
    return NewEntry(Label(str(number)), f"{number}.tif", content, disturbed(template, number))


def processor_times() -> Counter[int]:
    """Return the processor time of this process and of all that it has started, by number."""
    own = psutil.Process()
    found: Counter[int] = Counter()
    for process in (own, *own.children(recursive=True)):
        times = process.cpu_times()
        found[process.pid] = times.user + times.system  # type: ignore[assignment]
    return found


def main() -> int:
    """Run the script; return its exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--prints", type=int, default=10_000)
    parser.add_argument("--probes", type=int, default=64)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--candidate-list", default="auto", help="as of fpmatch identify")
    given = parser.parse_args()
    templates = sample_templates()
    with tempfile.TemporaryDirectory() as place, ExitStack() as stack:
        folder = Path(place, "probes")
        folder.mkdir()
        for k in range(given.probes):
            save_template(folder / f"{k}.json", disturbed(templates[k % len(templates)], 0, k))
        gallery = stack.enter_context(open_gallery(Path(place, "gallery.db"), create=True))
        for first in range(0, given.prints, BATCH):
            some = range(first, min(first + BATCH, given.prints))
            gallery.add([entry(templates[k % len(templates)], k) for k in some])
        open_search(gallery)
        bench = Bench(gallery, open_search(gallery), folder, given.candidate_list)
        engines = {"1 process": serial(), "2 processes": processes(2)}
        try:
            import distributed  # noqa: PLC0415
        except ImportError:
            print("without Dask: fpmatch[dask] is not installed")
        else:
            cluster = distributed.LocalCluster(
                n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=60
            )
            engines["Dask, 2 workers"] = dask(stack.enter_context(cluster).scheduler_address)
        for engine in engines.values():
            stack.enter_context(engine)
            bench.seconds(engine, WARM_UP)
        best = dict.fromkeys(engines, float("inf"))
        least = dict(best)
        files = set()
        print(f"{given.probes} probes, {given.prints} prints; seconds of each round:")
        for _ in range(given.rounds):
            for name, engine in engines.items():
                taken, cores, content = bench.seconds(engine)
                best[name], least[name] = min(best[name], taken), min(least[name], cores)
                files.add(content)
                load = f"load {os.getloadavg()[0]:.1f}"
                print(
                    f"  {name:<16}{taken:8.2f}{cores:8.2f} by processor time   {load}", flush=True
                )
        for name, taken in best.items():
            ratio, by_cores = best["1 process"] / taken, least["1 process"] / least[name]
            print(
                f"{name:<16}{taken:8.2f} s at best: {ratio:.2f} times as fast; on two idle cores "
                f"{least[name]:.2f} s: {by_cores:.2f}"
            )
        print("the files are the same" if len(files) == 1 else "THE FILES DIFFER")
    return 0 if len(files) == 1 else 1


if __name__ == "__main__":
    sys.exit(main())
