"""Measurement of the constants of a plan, on the prints of databases."""

from __future__ import annotations

import hashlib
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.spatial import Delaunay

from fpmatch.gallery.engine.processes import single_threaded
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index.embedding import embeddings
from fpmatch.gallery.index.print_segment import MOST_PRINTS
from fpmatch.gallery.index.prints.compact_template import CompactTemplates
from fpmatch.gallery.index.prints.stored_descriptors import StoredDescriptors
from fpmatch.gallery.index.segment import Segment
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.matching.matchers.unit_circle import MATCHER

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.templates.minutiae import Template

ENROLLED: Final = 10_000
BATCH: Final = 1_000
DELAUNAY_POINTS: Final = 40
PASSES: Final = 10  # other programs use the caches, too


def microseconds(work: Callable[[], object], count: int, passes: int = PASSES) -> float:
    """Return the least processor time of some passes of work, by the items that it is done on."""
    taken = []
    with single_threaded():  # several threads take time to wait for each other
        for _ in range(passes):
            start = time.process_time()
            work()
            taken.append(time.process_time() - start)
    return min(taken) / count * 1e6


def measure(sets: Sequence[ExtractedSet], search: list[tuple[int, float]]) -> dict[str, Any]:
    """Return the constants, as JSON values; a `search` of prints takes calls of Delaunay."""
    templates = [
        found.template for one in sets for found in one.extractions if found.template is not None
    ]
    points = np.random.default_rng(0).uniform(0, 300, (DELAUNAY_POINTS, 2))
    delaunay_us = microseconds(lambda: [Delaunay(points) for _ in range(500)], 500)
    enrol_us, database_bytes = _enrolment(templates)
    index_us, index_bytes = _index(templates)
    return {
        "delaunay_us": delaunay_us,
        "enrol_us": enrol_us,
        "index_us": index_us,
        "index_bytes": index_bytes,
        "database_bytes": database_bytes,
        "search": [(prints, 1e-6 * calls * delaunay_us) for prints, calls in search],
    }


def _enrolment(templates: Sequence[Template]) -> tuple[float, float]:
    """Return microseconds and bytes of an entry."""
    new = []
    for k in range(ENROLLED):
        source = f"/prints/{k}.iso"
        content = hashlib.sha256(source.encode()).digest()
        new.append(
            NewEntry(Label(str(k), "1", "1"), source, content, templates[k % len(templates)])
        )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "gallery.db")
        with open_gallery(path, create=True) as gallery:
            batches = [new[k : k + BATCH] for k in range(0, ENROLLED, BATCH)]
            taken = [microseconds(partial(gallery.add, batch), BATCH, 1) for batch in batches]
        return float(np.median(taken)), path.stat().st_size / ENROLLED


def _index(templates: Sequence[Template]) -> tuple[dict[str, float], dict[str, float]]:
    """Return microseconds and bytes a print of each part of an index."""
    packed = [pack_template(template) for template in templates]
    stored = [unpack_template(data) for data in packed]
    prints = [MATCHER.prepare(template) for template in stored]
    count, numbers = len(prints), np.arange(1, len(prints) + 1)
    steps: dict[str, Callable[[], object]] = {
        "unpack": lambda: [unpack_template(data) for data in packed],
        "prepare": lambda: [MATCHER.prepare(template) for template in stored],
        "terms": lambda: Segment.build(numbers, numbers, prints),  # with their embeddings
        "embeddings": lambda: embeddings(prints),
        "descriptors": lambda: StoredDescriptors.pack(prints),
        "compact": lambda: CompactTemplates.pack(stored),
    }
    taken = {name: microseconds(step, count) for name, step in steps.items()}
    taken["terms"] -= taken["embeddings"]
    segment = Segment.build(numbers, numbers, prints)
    lists = (segment.nbytes - segment.term_start.nbytes - segment.embedding.nbytes) / count
    sizes = {
        "lists": lists + segment.term_start.nbytes / MOST_PRINTS,
        "embeddings": segment.embedding.nbytes / count,
        "descriptors": StoredDescriptors.pack(prints).nbytes / count,
        "templates": CompactTemplates.pack(stored).nbytes / count,
    }
    return taken, sizes
