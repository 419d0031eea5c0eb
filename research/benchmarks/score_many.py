#!/usr/bin/env python3
"""Score very many references against a few probes: comparisons a second, and peak memory.

    .venv/bin/python research/benchmarks/score_many.py [--references 100000] [--probes 10]
        [--workers 1]

The references are templates of the sample prints as galleries keep them, each disturbed in another
way. The exit status is 1 where all processes together used 1 GB or more.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from disturbed_prints import disturbed, sample_templates

from fpmatch.gallery.batch.score import score
from fpmatch.gallery.batch.sources import StoredTemplate
from fpmatch.gallery.engine.engine import make_engine
from fpmatch.matching.registry import DEFAULT_MATCHER
from fpmatch.templates.stored_template import pack_template

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.templates.minutiae import Template

MAX_BYTES = 1e9
REPORT_EVERY_S = 20.0


class Disturbed:
    """A source of templates, each disturbed at random by its number."""

    def __init__(self, place: str, count: int, templates: list[Template]) -> None:
        self.place = self.title = place
        self.fingers = self.names = [f"{place}_{n}" for n in range(count)]
        self.content_hash = f"{place} {count}"
        self._templates = templates

    def templates(
        self, engine: Engine, numbers: Sequence[int]
    ) -> Generator[StoredTemplate, None, None]:
        """Yield the templates of some numbers."""
        for number in numbers:
            template = self._templates[number % len(self._templates)]
            yield StoredTemplate(pack_template(disturbed(template, number, len(self.place))))


class ProgressReport:
    """Print the progress every few seconds."""

    def __init__(self) -> None:
        self._next = time.monotonic() + REPORT_EVERY_S

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Print it, where it is due."""
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + REPORT_EVERY_S
            print(f"{stage}: {done:,} of {total:,}", file=sys.stderr, flush=True)


def peak_bytes(workers: int) -> tuple[float, float]:
    """Return the peak memory of this process, and of its largest worker."""
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024.0
    return own, largest if workers > 1 else 0.0


def main() -> int:
    """Run the script; return its exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--references", type=int, default=100_000)
    parser.add_argument("--probes", type=int, default=10)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--matcher", default=DEFAULT_MATCHER)
    asked = parser.parse_args()
    templates = sample_templates()
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "scores.csv")
        done = score(
            Disturbed("reference", asked.references, templates),
            Disturbed("probe", asked.probes, templates),
            output,
            matcher=asked.matcher,
            engine=make_engine(asked.workers),
            progress=ProgressReport(),
        )
        size = output.stat().st_size
    seconds = time.perf_counter() - begun
    own, worker = peak_bytes(asked.workers)
    total = own + asked.workers * worker
    print(f"{done.references:,} x {done.probes} pairs, matcher {asked.matcher}")
    print(f"comparisons a second       {done.rate:12,.0f}  ({asked.workers} processes)")
    print(f"comparing, all in all, s   {done.seconds:12.1f}  {seconds:.1f}")
    print(f"rows, bytes a row          {done.rows:12,}  {size / done.rows:.1f}")
    print(f"peak memory, MB            {total / 1e6:12.0f}  ({own / 1e6:.0f} of it here)")
    return int(total >= MAX_BYTES)


if __name__ == "__main__":
    sys.exit(main())
