#!/usr/bin/env python3
"""Search a large gallery: time to open it, and comparisons a second.

    .venv/bin/python benchmarks/search_gallery.py [--most 100000]

For 1,000, 10,000 and 100,000 enrolled templates (or as many as `--most` allows) of sample prints,
disturbed: seconds to enrol them, to open the gallery for the first search, which prepares it, and
for a second one, when it is prepared; comparisons a second on one core; bytes a template in
the database, and prepared.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from disturbed_prints import disturbed, sample_templates

from fpmatch.gallery.compact import pack_template
from fpmatch.gallery.entry import Label, NewEntry
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.search import open_search

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.search import Search
    from fpmatch.minutiae import Template

COUNTS = (1_000, 10_000, 100_000)
BATCH = 500  # entries a transaction
PROBES = 5


def entries(templates: list[Template], first: int, last: int) -> Iterator[NewEntry]:
    """Yield the entries of some numbers."""
    for number in range(first, last):
        template = disturbed(templates[number % len(templates)], number)
        digest = hashlib.sha256(str(number).encode()).digest()
        yield NewEntry(Label(str(number)), f"{number}.tif", digest, template)


def opened(path: Path) -> tuple[Search, float]:
    """Open a search, and return it with the seconds that it took."""
    start = time.perf_counter()
    with open_gallery(path) as gallery:
        search = open_search(gallery)
    return search, time.perf_counter() - start


def rate(search: Search, probes: list[Template]) -> float:
    """Return comparisons a second of processor time."""
    prepared = [search.matcher.prepare(probe) for probe in probes]
    search.similarities(prepared[0])  # what is mapped is read
    start = time.process_time()
    for probe in prepared:
        search.similarities(probe)
    return len(search) * len(prepared) / (time.process_time() - start)


def grow(gallery: Gallery, templates: list[Template], first: int, last: int) -> float:
    """Enrol templates, and return the seconds that it took beyond making them."""
    taken = 0.0
    for at in range(first, last, BATCH):
        batch = list(entries(templates, at, min(at + BATCH, last)))
        start = time.perf_counter()
        gallery.add(batch)
        taken += time.perf_counter() - start
    return taken


def main() -> int:
    """Run the script; return its exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--most", type=int, default=COUNTS[-1], help="templates, at most")
    most = parser.parse_args().most
    templates = sample_templates()
    probes = [disturbed(t, 0, k) for k, t in enumerate(templates[:PROBES])]
    size = sum(len(pack_template(disturbed(templates[k % 16], k))) for k in range(160)) / 160
    print(
        f"{'templates':>9}{'enrol s':>9}{'1st open s':>12}{'2nd open s':>12}{'a second':>10}"
        f"{'bytes':>7}{'in the file':>13}{'prepared':>10}"
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "gallery.db")
        there = 0
        for count in [c for c in COUNTS if c <= most]:
            with open_gallery(path, create=True) as gallery:
                enrolled = grow(gallery, templates, there, count)
            there = count
            _, first = opened(path)
            search, second = opened(path)
            kept = sum(f.stat().st_size for f in Path(folder).rglob("*") if f.is_file())
            file = path.stat().st_size
            print(
                f"{count:9}{enrolled:9.1f}{first:12.2f}{second:12.2f}{rate(search, probes):10.0f}"
                f"{size:7.0f}{file / count:13.0f}{(kept - file) / count:10.0f}",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
