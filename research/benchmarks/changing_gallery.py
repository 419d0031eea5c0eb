#!/usr/bin/env python3
"""Search a large gallery while it changes, and for many probes at once.

.venv/bin/python research/benchmarks/changing_gallery.py --keep FOLDER [--prints 131072]
    [--json FILE]
"""

from __future__ import annotations

import os
import random
import secrets
import shutil
import tempfile
import time
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from made_gallery import PART, SEED, sensor_of
from search_one import LOSS, fill
from two_processes import gain_of_two_processes

from fpmatch.gallery.engine.engine import processes
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.search.entries import identify_each, identify_entries
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.search.search import SearchOptions
from fpmatch.lab.synthesis.templates import make_templates
from research.commands import PATH, Command, json_file, print_and_write

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.search.search import Search
    from fpmatch.templates.minutiae import Template

MAX_RATIO = 1.5  # of the 95th percentiles: while the gallery changes, and before
OPTIONS = SearchOptions(loss=LOSS)
BATCH_S = 1.0  # from one enrolment and removal to the next


def templates(first: int, count: int) -> list[Template]:
    """Return templates of synthetic fingers that the gallery does not have."""
    numbers = range(first, first + count)
    return [t for k in numbers for t in make_templates(SEED + 1, [k], sensors=[sensor_of(k)])]


def mates(prints: int, count: int) -> list[Template]:
    """Return second impressions of as many fingers of the gallery, evenly spaced."""
    return [
        made
        for k in np.linspace(0, prints - 1, count).astype(int).tolist()
        for made in make_templates(SEED, [k], first_impression=2, sensors=[sensor_of(k // PART)])
    ]


def change(path: Path, prints: int, a_minute: int, counts: Any, end: Any) -> None:
    """Enrol and remove entries evenly until the `end`; count both, and how many are due."""
    new = templates(prints, 64)
    left = random.Random(1).sample(range(1, prints + 1), prints)
    with open_gallery(path) as gallery:
        start = time.perf_counter()
        while not end.wait(BATCH_S):
            due = counts[2] = int((time.perf_counter() - start) * a_minute / 60)
            entries = [
                NewEntry(Label(f"new{k}"), str(k), secrets.token_bytes(32), new[k % len(new)])
                for k in range(counts[0], due)
            ]
            gallery.add(entries)
            counts[0] = due
            gallery.remove([left.pop() for _ in entries])
            counts[1] = due


def now() -> float:
    """Return the time, less what this thread has waited for a core: as on idle cores (Linux)."""
    waited = int(Path("/proc/thread-self/schedstat").read_text(encoding="ascii").split()[1])
    return time.perf_counter() - waited / 1e9


def latencies(
    gallery: Gallery, search: Search, probes: Sequence[Template], seconds: float, counts: Any
) -> np.ndarray:
    """Return the times of searches of the gallery as it is, one after the other."""
    taken, end, before = [], time.perf_counter() + seconds, int(search.numbers[-1]) - counts[0]
    while time.perf_counter() < end:
        enrolled, start = counts[0], now()
        search = search.current(gallery)
        identify_entries(gallery, search, probes[len(taken) % len(probes)], OPTIONS, workers=1)
        taken.append(now() - start)
        if search.numbers[-1] < before + enrolled:
            raise AssertionError("a search does not see what was enrolled before")
    return np.array(taken)


def probes_a_second(
    gallery: Gallery, search: Search, probes: Sequence[Template], workers: int
) -> tuple[float, str]:
    """Return the throughput of a search for many probes, and its results."""
    start = time.perf_counter()
    with processes(workers) as engine:
        results = list(identify_each(gallery, search, probes, OPTIONS, engine))
    return len(probes) / (time.perf_counter() - start), repr(results)


@click.command(cls=Command)
@click.option("--keep", type=PATH, required=True, help="Keep the gallery in this folder.")
@click.option("--prints", default=131_072, show_default=True)
@click.option("--probes", default=200, show_default=True, help="Probes of one batch.")
@click.option("--with-mates", is_flag=True, help="Each probe of the batch has a mate.")
@click.option("--seconds", default=60, show_default=True, help="Time for searches one by one.")
@click.option("--changes", default=1000, show_default=True, help="Enrolments a minute.")
@json_file
@click.pass_context
def main(
    context: click.Context,
    keep: Path,
    prints: int,
    probes: int,
    with_mates: bool,
    seconds: int,
    changes: int,
    json_file: Path | None,
) -> None:
    """Search a large gallery while it changes, and for many probes at once.

    The gallery has synthetic prints of different fingers (`made_gallery.py`); they, its database
    and its index are kept in FOLDER. Probes of other fingers are searched for in a copy by one
    thread, one after the other: first quietly, then while another process enrols and removes
    entries once a second, as many a minute as --changes states. One batch of probes is searched for
    by one process and by two, which needs idle cores, beside two processes of plain arithmetic; of
    single searches, the waits for a core do not count. The exit status is 1 where the 95th
    percentile grows by more than half, the other process makes less than nine of ten changes, or
    results differ.
    """
    batch = mates(prints, probes) if with_mates else templates(0, probes)
    asked = templates(0, 16)
    kept = keep / f"gallery-{prints}.db"
    with open_gallery(kept, create=True) as gallery:
        fill(gallery, keep, prints)
        _ = open_search(gallery).numbers
    fork = get_context("spawn")
    counts, end = fork.Array("q", 3), fork.Event()
    with tempfile.TemporaryDirectory(dir=keep) as folder:
        path = Path(shutil.copy(kept, folder))
        files = f"{kept.name}.prepared"
        shutil.copytree(keep / files, Path(folder, files))
        changer = fork.Process(target=change, args=(path, prints, changes, counts, end))
        with open_gallery(path) as gallery:
            start = time.perf_counter()
            search = open_search(gallery)
            opened = [time.perf_counter() - start]
            _ = search.numbers  # checks and maps all segments
            opened.append(time.perf_counter() - start)
            throughput = {n: probes_a_second(gallery, search, batch, n) for n in (1, 2)}
            arithmetic = gain_of_two_processes()
            latencies(gallery, search, asked, 1.0, counts)
            quiet = latencies(gallery, search, asked, seconds, counts)
            changer.start()
            while not counts[1]:
                time.sleep(BATCH_S)
            changing = latencies(gallery, search, asked, seconds, counts)
        end.set()
        changer.join()
    ratio = float(np.percentile(changing, 95) / np.percentile(quiet, 95))
    by_workers = {n: rate for n, (rate, _) in throughput.items()}
    results = {
        "prints": prints,
        "opened_s": np.round(opened, 4).tolist(),  # the list of the segments, and all of these
        "quiet_s": np.percentile(quiet, [50, 95]).round(4).tolist(),
        "changing_s": np.percentile(changing, [50, 95]).round(4).tolist(),
        "ratio": round(ratio, 2),
        **dict(zip(("enrolled", "removed", "due"), counts, strict=True)),
        "probes_a_second": by_workers,
        "cores": round(by_workers[2] / by_workers[1], 2),
        "cores_of_arithmetic": round(arithmetic, 2),
        "load": os.getloadavg()[0],
    }
    print_and_write(str(results), results, json_file)
    same = throughput[1][1] == throughput[2][1]
    context.exit(int(ratio > MAX_RATIO or counts[1] < 0.9 * counts[2] or not same))


if __name__ == "__main__":
    main()
