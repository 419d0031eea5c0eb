#!/usr/bin/env python3
"""Measure what is stored of a print: bytes by part, and error rates of forms of templates.

    .venv/bin/python research/benchmarks/compact_templates.py [--json FILE] DIR...

Each DIR is an FVC-style database. The rates are means over all, of templates that are stored on one
side, as a search compares them with a probe, and on both.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import repository  # noqa: F401
from scipy.spatial import Delaunay

from fpmatch.gallery.index.prints.compact_template import (
    CompactTemplates,
    compact,
    expand,
    prepare_compact,
)
from fpmatch.gallery.index.prints.descriptor_scores import prefilter_scores
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.gallery.index.prints.stored_descriptors import StoredDescriptors
from fpmatch.gallery.index.segment import Segment
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.lab.evaluation.run import evaluate_templates
from fpmatch.matching.prints.bit_descriptors import prefilter_of
from fpmatch.matching.prints.prepare import prepare
from research.commands import Command, folders, json_file, workers, write_json
from research.databases import extract_folders
from research.tables.stored_prints import RATES, stored_forms, stored_parts, stored_times

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.templates.minutiae import Template

TIMED = 5  # the fastest of so many rounds
COPIES = 20  # of each print, that are scored


def exact(template: Template) -> Template:
    """Return a template that has been in a gallery."""
    return unpack_template(pack_template(template))


def without_ridges(template: Template) -> Template:
    """Return a template whose ridges are not kept."""
    kept = exact(template)
    if kept.field is None:
        return kept
    return replace(kept, field=replace(kept.field, ridges=None))


FORMS: Mapping[str, tuple[Callable[[Template], Template], Callable[[Template], bytes] | None]] = {
    "as extracted": (lambda template: template, None),
    "all bits, as galleries keep them": (exact, pack_template),
    "8 bits a cell, estimated: compact": (lambda template: expand(compact(template)), compact),
    "without ridges": (without_ridges, compact),
}
"""What comes back of a template, and what it is packed by."""


def templates_of(sets: Sequence[ExtractedSet]) -> list[Template]:
    """Return the templates of databases."""
    return [e.template for s in sets for e in s.extractions if e.template is not None]


def measure_forms(sets: list[ExtractedSet], processes: int | None) -> list[dict[str, Any]]:
    """Return bytes and mean rates of each form of templates."""
    measured = []
    for name, (form, pack) in FORMS.items():
        stored = [
            replace(
                s,
                extractions=tuple(
                    e if e.template is None else replace(e, template=form(e.template))
                    for e in s.extractions
                ),
            )
            for s in sets
        ]
        size = pack and float(np.mean([len(pack(form(one))) for one in templates_of(sets)]))
        row: dict[str, Any] = {"form": name, "bytes": size}
        for side, probes in (("one", sets), ("both", stored)):
            report = evaluate_templates(stored, probes=probes, workers=processes)
            row[side] = {
                k: float(np.mean([getattr(r.rates, k) for r in report.sets])) for k in RATES
            }
            row[side]["each_eer"] = {r.name: r.rates.eer for r in report.sets}
        measured.append(row)
        print(stored_forms([row]).splitlines()[-1], flush=True)
    return measured


def measure_parts(sets: list[ExtractedSet]) -> list[dict[str, Any]]:
    """Return the mean bytes of a print of each database, by part."""
    measured = []
    for one in sets:
        templates = [exact(template) for template in templates_of([one])]
        prints, numbers = [prepare(template) for template in templates], np.arange(len(templates))
        index = Segment.build(numbers, numbers, prints)
        parts = {
            # the starts of terms are those of 65,536 prints
            "index": index.nbytes - index.term_start.nbytes,
            "descriptors": StoredDescriptors.pack(prints).nbytes,
            "template": CompactTemplates.pack(templates).nbytes,
            "minutiae": sum(map(len, templates)),
            "gallery": sum(len(pack_template(template)) for template in templates),
            "prepared": PreparedPrints.pack(prints).nbytes,
        }
        measured.append(
            {"name": one.dataset.name, **{k: v / len(prints) for k, v in parts.items()}}
        )
    return measured


def measure_times(sets: list[ExtractedSet]) -> dict[str, Any]:
    """Return CPU times in microseconds, and how much is scored otherwise than by the prefilter."""
    templates = [exact(template) for template in templates_of(sets)][::4]
    packed = [compact(template) for template in templates]
    prints = [prepare(template) for template in templates]
    many, every = CompactTemplates.of_bytes(packed), np.arange(len(packed))
    full = PreparedPrints.concatenate([PreparedPrints.pack(prints)] * COPIES)
    small = StoredDescriptors.concatenate([StoredDescriptors.pack(prints)] * COPIES)
    probes, count = prints[::16], len(full)
    places: NDArray[np.float64] = np.random.default_rng(0).uniform(0, 300, (40, 2))
    scores = [(prefilter_scores(p, full), small.scores(p)) for p in probes]
    return {
        "delaunay": each_us(lambda: [Delaunay(places) for _ in range(100)], 100),
        "compact": each_us(lambda: [compact(template) for template in templates], len(templates)),
        "expand": each_us(lambda: [expand(data) for data in packed], len(packed)),
        "prepare": each_us(lambda: [prepare(template) for template in templates], len(templates)),
        "pack": each_us(lambda: PreparedPrints.pack(prints), len(prints)),
        "prepare_compact": each_us(lambda: prepare_compact(many, every), len(prints)),
        "pack_descriptors": each_us(lambda: StoredDescriptors.pack(prints), len(prints)),
        "prefilter": float(np.mean([prefilter_us(p, full, None) for p in probes])),
        "packed_prefilter": float(np.mean([prefilter_us(p, full, small) for p in probes])),
        "scores": count * len(probes),
        "other_scores": int(sum(np.count_nonzero(a != b) for a, b in scores)),
    }


def prefilter_us(
    probe: PreparedTemplate, full: PreparedPrints, small: StoredDescriptors | None
) -> float:
    """Return the CPU time to score a print, in microseconds."""
    if small is None:
        return each_us(lambda: prefilter_scores(probe, full), len(full))
    tables = prefilter_of(probe.bit_descriptors)
    return each_us(lambda: small.scores(tables), len(small))


def each_us(work: Callable[[], Any], count: int) -> float:
    """Return the least CPU time of some rounds, divided by a count, in microseconds."""
    times = []
    for _ in range(TIMED):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return 1e6 * min(times) / count


@click.command(cls=Command)
@folders
@workers
@json_file
def main(folders: tuple[Path, ...], json_file: Path | None, workers: int | None) -> None:
    """Measure on the databases FOLDERS.

    --json writes what ``python -m research tables searching --stored`` reads.
    """
    sets = extract_folders(folders)
    results = {"times": measure_times(sets), "parts": measure_parts(sets)}
    print(stored_times(results["times"]), stored_parts(results["parts"]), sep="\n\n")
    print()
    results["forms"] = measure_forms(sets, workers)
    print(f"\n{stored_forms(results['forms'])}")
    if json_file:
        write_json(json_file, results)


if __name__ == "__main__":
    sys.exit(main())
