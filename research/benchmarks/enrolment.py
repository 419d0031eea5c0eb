#!/usr/bin/env python3
"""Enrol templates and open their gallery: processor time a template, seconds to open.

.venv/bin/python research/benchmarks/enrolment.py [--prints 30000] [--json FILE]
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np
import repository  # noqa: F401
from scipy.spatial import Delaunay

from fpmatch.base.text_table import text_table
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index.loss import DEFAULT_LOSS, EXHAUSTIVE_UP_TO
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.tasks.transfer import enrol_gallery
from fpmatch.lab.synthesis.templates import make_templates
from research.commands import Command, json_file, write_json

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.gallery.gallery import Gallery

BATCH = 1_000  # templates a transaction
MOST_US = 600.0  # a template: 100,000 a minute
MOST_OPEN_S = 1.0


def cpu(work: Callable[[], object]) -> float:
    """Return the processor time of one call, in seconds."""
    start = time.process_time()
    work()
    return time.process_time() - start


def entries(first: int, last: int) -> list[NewEntry]:
    """Return entries of different synthetic fingers."""
    found = []
    for number, template in zip(
        range(first, last), make_templates(1, range(first, last)), strict=True
    ):
        content = hashlib.sha256(str(number).encode()).digest()
        found.append(NewEntry(Label(str(number), "1", "1"), f"{number}.iso", content, template))
    return found


def grow(gallery: Gallery, first: int, last: int) -> float:
    """Enrol templates, and return the processor time beyond making them."""
    starts = range(first, last, BATCH)
    batches = (entries(k, min(k + BATCH, last)) for k in starts)
    return sum(cpu(lambda batch=batch: gallery.add(batch)) for batch in batches)


def evict(folder: Path) -> None:
    """Let the system forget the content of all files of a folder, where it can."""
    for path in (path for path in folder.rglob("*") if path.is_file()):
        with path.open("rb") as stream:
            os.fsync(stream.fileno())
            if hasattr(os, "posix_fadvise"):
                os.posix_fadvise(stream.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def opening(path: Path) -> float:
    """Return the seconds to open a gallery and its search."""
    start = time.perf_counter()
    with open_gallery(path) as gallery:
        open_search(gallery, loss=DEFAULT_LOSS)
    return time.perf_counter() - start


def measure(prints: int, folder: Path) -> dict[str, float]:
    """Return times: microseconds of processor time a template, and seconds to open."""
    points = np.random.default_rng(0).uniform(0, 300, (40, 2))
    call = cpu(lambda: [Delaunay(points) for _ in range(500)]) / 500
    few = min(prints, EXHAUSTIVE_UP_TO)
    path = folder / "gallery.db"
    with open_gallery(path, create=True) as gallery:
        enrolled = grow(gallery, 0, few)
        with open_gallery(folder / "copy.db", create=True) as other:
            copied = cpu(lambda: enrol_gallery(other, gallery))  # too few for an index
        enrolled += grow(gallery, few, prints)
        indexed = cpu(lambda: open_search(gallery, engine=serial(), loss=DEFAULT_LOSS))
    warm = opening(path)
    evict(folder)
    return {
        "prints": prints,
        "delaunay_us": 1e6 * call,
        "enrol_us": 1e6 * enrolled / prints,
        "copy_us": 1e6 * copied / few,
        "index_us": 1e6 * indexed / prints,
        "open_warm_s": warm,
        "open_cold_s": opening(path),
    }


@click.command(cls=Command)
@click.option("--prints", default=30_000, show_default=True, help="Templates, all different.")
@json_file
@click.pass_context
def main(context: click.Context, prints: int, json_file: Path | None) -> None:
    """Enrol templates and open their gallery: processor time a template, seconds to open.

    The templates are those of synthetic fingers, each of its own finger. Measured are the
    enrolment in a SQLite file through Python in transactions of a thousand, the enrolment of
    entries of another gallery, and the indexing of more than 20,000 (or, of fewer, their
    preparation), each in processor time of one core beyond making the templates; then the time to
    open the gallery for a search, with its files in the system's cache and without. The exit status
    is 1 where enrolment and indexing take more than 600 µs a template, or opening more than 1 s.
    """
    with tempfile.TemporaryDirectory() as folder:
        found = measure(prints, Path(folder))
    call = found["delaunay_us"]
    names = {"enrol_us": "enrolment", "copy_us": "from another gallery", "index_us": "indexing"}
    rows = [("a template", "µs", "Delaunay calls")]
    rows += [(name, f"{found[key]:.0f}", f"{found[key] / call:.1f}") for key, name in names.items()]
    click.echo(text_table(rows))
    warm, cold = found["open_warm_s"], found["open_cold_s"]
    click.echo(f"opened in {warm:.2f} s, without the system's cache in {cold:.2f} s")
    if json_file:
        write_json(json_file, found)
    slow = found["enrol_us"] + found["index_us"] > MOST_US or cold > MOST_OPEN_S
    context.exit(int(slow))


if __name__ == "__main__":
    main()
