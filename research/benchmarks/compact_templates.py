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
from functools import partial
from typing import TYPE_CHECKING, Any

import click
import cv2
import numpy as np
import repository  # noqa: F401
from scipy.spatial import Delaunay

from fpmatch.evaluation.databases.extraction import extract_datasets
from fpmatch.evaluation.run import evaluate_templates, load_datasets
from fpmatch.gallery.compact import pack_template, unpack_template
from fpmatch.indexing.segment import Segment
from fpmatch.matching.bit_descriptors import prefilter_of
from fpmatch.matching.candidate_list import prefilter_scores
from fpmatch.matching.compact_template import CompactTemplates, compact, expand
from fpmatch.matching.packed_descriptors import PackedDescriptors
from fpmatch.matching.packed_templates import PackedTemplates
from fpmatch.matching.prepare import prepare
from fpmatch.matching.prepare_compact import prepare_compact
from fpmatch.matching.ridge_samples import ORIENTATIONS, RidgeSampleParameters
from research.commands import Command, folders, json_file, workers, write_json
from research.tables.stored_prints import RATES, stored_forms, stored_parts, stored_times

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.evaluation.databases.extraction import ExtractedSet
    from fpmatch.matching.prepare import PreparedTemplate
    from fpmatch.minutiae import Template

REACH = 5  # bits, of the weights of an estimate
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


def sampled(template: Template, *, kept: Callable[[Any, Any], Any], estimated: bool) -> Template:
    """Return a template of whose ridges some bits are kept, by row and column.

    The others are estimated along the ridges as `fpmatch.matching.ridge_samples` does, or they are
    those of the nearest kept bit.
    """
    p, found = RidgeSampleParameters(), exact(template)
    if found.field is None or found.field.ridges is None:
        return found
    bits, field = found.field.bits, found.field
    rows, columns = field.mask.shape
    known = np.kron(field.mask, np.ones((8, 8), bool))
    chosen = kept(*np.indices(bits.shape)) & known
    if estimated:
        signs = np.where(chosen, np.where(bits, 1.0, -1.0), 0.0)
        steps = np.rint(field.orientation * (ORIENTATIONS / np.pi)).astype(int) % ORIENTATIONS
        steps = np.kron(steps, np.ones((8, 8), int))
        dy, dx = np.mgrid[-REACH : REACH + 1, -REACH : REACH + 1]
        result = np.zeros(bits.shape, bool)
        for step in range(ORIENTATIONS):
            c, s = np.cos(step * np.pi / ORIENTATIONS), np.sin(step * np.pi / ORIENTATIONS)
            along, across = (dx * c - dy * s) / p.along, dx * s + dy * c
            fading = np.exp(-0.5 * (along**2 + (across / p.across) ** 2))
            weight = fading * np.cos(2 * np.pi / p.period * across)
            total = cv2.filter2D(signs, -1, weight, borderType=cv2.BORDER_CONSTANT)
            result[steps == step] = total[steps == step] >= 0
    else:
        away = cv2.distanceTransformWithLabels(
            (~chosen).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
        )[1]
        value = np.zeros(away.max() + 1, bool)
        value[away[chosen]] = bits[chosen]
        result = value[away]
    result = np.where(chosen, bits, result & known)
    cells = result.reshape(rows, 8, columns, 8).swapaxes(1, 2).reshape(rows, columns, 64)
    ridges = np.packbits(cells, axis=2, bitorder="little").view("<u8")[..., 0]
    return replace(found, field=replace(field, ridges=ridges))


def every_other(row: Any, column: Any) -> Any:
    """Keep every other bit of every other row: sixteen a cell."""
    return (row % 2 == 1) & (column % 2 == 1)


def by_turns(row: Any, column: Any) -> Any:
    """Keep every fourth bit of every other row, by turns: eight a cell."""
    return (row % 2 == 1) & (column % 4 == row % 4)


def every_fourth(row: Any, column: Any) -> Any:
    """Keep every fourth bit of every fourth row: four a cell."""
    return (row % 4 == 1) & (column % 4 == 1)


FORMS: Mapping[str, tuple[Callable[[Template], Template], float | None]] = {
    "as extracted": (lambda template: template, None),
    "all bits, as galleries keep them": (exact, 8),
    "16 bits a cell, the nearest": (partial(sampled, kept=every_other, estimated=False), 2),
    "16 bits a cell, estimated": (partial(sampled, kept=every_other, estimated=True), 2),
    "8 bits a cell, the nearest": (partial(sampled, kept=by_turns, estimated=False), 1),
    "8 bits a cell, estimated: compact": (lambda template: expand(compact(template)), 1),
    "4 bits a cell, estimated": (partial(sampled, kept=every_fourth, estimated=True), 0.5),
    "without ridges": (without_ridges, 0),
}
"""What comes back of a template, and the bytes a cell of its ridges."""


def templates_of(sets: Sequence[ExtractedSet]) -> list[Template]:
    """Return the templates of databases."""
    return [e.template for s in sets for e in s.extractions if e.template is not None]


def measure_forms(sets: list[ExtractedSet], processes: int | None) -> list[dict[str, Any]]:
    """Return bytes and mean rates of each form of templates."""
    measured = []
    cells = np.mean([cells_of(template) for template in templates_of(sets)])
    bare = np.mean([len(compact(template)) for template in templates_of(sets)]) - cells
    for name, (form, cell_bytes) in FORMS.items():
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
        size = None if cell_bytes is None else float(bare + cell_bytes * cells)
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


def cells_of(template: Template) -> int:
    """Return the number of cells of a template that show ridges."""
    field = template.field
    return 0 if field is None or field.ridges is None else int(np.count_nonzero(field.mask))


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
            "descriptors": PackedDescriptors.pack(prints).nbytes,
            "template": CompactTemplates.pack(templates).nbytes,
            "minutiae": sum(map(len, templates)),
            "gallery": sum(len(pack_template(template)) for template in templates),
            "prepared": PackedTemplates.pack(prints).nbytes,
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
    full = PackedTemplates.concatenate([PackedTemplates.pack(prints)] * COPIES)
    small = PackedDescriptors.concatenate([PackedDescriptors.pack(prints)] * COPIES)
    probes, count = prints[::16], len(full)
    places: NDArray[np.float64] = np.random.default_rng(0).uniform(0, 300, (40, 2))
    scores = [(prefilter_scores(p, full), small.scores(p)) for p in probes]
    return {
        "delaunay": each_us(lambda: [Delaunay(places) for _ in range(100)], 100),
        "compact": each_us(lambda: [compact(template) for template in templates], len(templates)),
        "expand": each_us(lambda: [expand(data) for data in packed], len(packed)),
        "prepare": each_us(lambda: [prepare(template) for template in templates], len(templates)),
        "pack": each_us(lambda: PackedTemplates.pack(prints), len(prints)),
        "prepare_compact": each_us(lambda: prepare_compact(many, every), len(prints)),
        "pack_descriptors": each_us(lambda: PackedDescriptors.pack(prints), len(prints)),
        "prefilter": float(np.mean([prefilter_us(p, full, None) for p in probes])),
        "packed_prefilter": float(np.mean([prefilter_us(p, full, small) for p in probes])),
        "scores": count * len(probes),
        "other_scores": int(sum(np.count_nonzero(a != b) for a, b in scores)),
    }


def prefilter_us(
    probe: PreparedTemplate, full: PackedTemplates, small: PackedDescriptors | None
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
    sets = extract_datasets(load_datasets(folders))
    results = {"times": measure_times(sets), "parts": measure_parts(sets)}
    print(stored_times(results["times"]), stored_parts(results["parts"]), sep="\n\n")
    print()
    results["forms"] = measure_forms(sets, workers)
    print(f"\n{stored_forms(results['forms'])}")
    if json_file:
        write_json(json_file, results)


if __name__ == "__main__":
    sys.exit(main())
