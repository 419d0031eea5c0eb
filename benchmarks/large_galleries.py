#!/usr/bin/env python3
"""Measure searches of large galleries by a candidate list: time, memory, pre-selection errors.

.venv/bin/python benchmarks/large_galleries.py [--most 1000000] [--json FILE] [DIR...]
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import click
import numpy as np
import repository  # noqa: F401
from disturbed_prints import sample_templates
from one_to_many import MOVE_PX, SHARE_KEPT, TURN_RAD, without_prefilter

from fpmatch.evaluation.extraction import extract_datasets
from fpmatch.evaluation.run import load_datasets
from fpmatch.gallery.identify import PENETRATION_RATE
from fpmatch.matching.bit_descriptors import BitDescriptors, encode
from fpmatch.matching.candidate_list import normalized_prefilter_scores
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.packed_templates import PackedTemplates
from fpmatch.minutiae import Minutiae, RidgeField, Template
from fpmatch.output import check_writable
from research.commands import PATH, Command, json_file, write_json
from research.tables.searching import format_searching

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from fpmatch.matching.prepare import PreparedTemplate

COUNTS = (10_000, 100_000, 1_000_000)
DIFFERENT = 5_000  # prints that are prepared; of more, each stands for several
PROBES = 5
COMPARED = 500  # prints at once, in turn
IMPRESSIONS = 4  # of each finger among the sample prints, of which the first is copied
COPIES = 8
RECOMBINED = 1_000  # prints beside those of a database, where mates are looked for
MAX_SHARE_OF_TIME = 0.1
MIN_RECALL = 0.99


@dataclass(frozen=True)
class Kind:
    """Hold the templates of one kind of print, and their fingers."""

    name: str
    templates: Sequence[Template]
    finger: Sequence[object]


def moved(template: Template, rng: np.random.Generator, share: float = 1.0) -> Minutiae:
    """Return a share of the minutiae of a print, moved and turned a little."""
    m = template.minutiae
    m = m.take(np.sort(rng.permutation(len(m))[: round(share * len(m))]))
    n = len(m)
    x = np.clip(m.x + rng.normal(0, MOVE_PX, n), 0, template.width - 1)
    y = np.clip(m.y + rng.normal(0, MOVE_PX, n), 0, template.height - 1)
    return Minutiae(x, y, m.angle + rng.normal(0, TURN_RAD, n), m.kind, m.quality)


def mirrored(template: Template) -> Template:
    """Return the mirror image of a print, which is of another finger."""
    field = template.field
    assert field is not None
    width = field.step * field.mask.shape[1]
    m = template.minutiae
    x = np.clip(width - 1 - m.x, 0, template.width - 1)
    minutiae = Minutiae(x, m.y, np.pi - m.angle, m.kind, m.quality)
    flow = np.where(field.mask, np.mod(-field.orientation, np.pi), 0.0)[:, ::-1]
    ridges = field.ridges
    if ridges is not None:
        rows = np.ascontiguousarray(ridges[:, ::-1])[..., None].view(np.uint8)
        turned = np.packbits(np.unpackbits(rows[..., None], axis=-1), axis=-1, bitorder="little")
        ridges = np.ascontiguousarray(turned[..., 0]).view(np.uint64)[..., 0]
    return replace(
        template,
        minutiae=minutiae,
        field=RidgeField(field.step, flow, np.ascontiguousarray(field.mask[:, ::-1]), ridges),
    )


def recombined(templates: Sequence[Template], rng: np.random.Generator) -> Template:
    """Return a print that is combined from the parts of two prints on either side of a line."""
    one, other = (templates[k] for k in rng.integers(0, len(templates), 2))
    parts = []
    angle, middle = rng.uniform(0, 2 * np.pi), (one.width / 2, one.height / 2)
    for side, template in ((1, one), (-1, other)):
        m = moved(template, rng)
        across = (m.x - middle[0]) * np.cos(angle) + (m.y - middle[1]) * np.sin(angle)
        parts.append(m.take(np.flatnonzero(side * across > 0)))
    columns = ("x", "y", "angle", "kind", "quality")
    joined = Minutiae(*(np.concatenate([getattr(p, c) for p in parts]) for c in columns))
    return replace(one, minutiae=joined)


def seconds(function: Callable[[], object]) -> float:
    """Return the processor time of one call."""
    start = time.process_time()
    function()
    return time.process_time() - start


def encoded(print_: PreparedTemplate) -> BitDescriptors:
    """Return the bit descriptors of a print, encoded again."""
    return encode(print_.points, print_.quality, print_.neighbourhoods, print_.region)


def times(few: PackedTemplates, count: int) -> dict[str, float]:
    """Return processor time, in microseconds a print, of a search of so many prints."""
    encoding = seconds(lambda: [encoded(few[k]) for k in range(COMPARED)])
    encoding = (encoding - seconds(lambda: [few[k] for k in range(COMPARED)])) / COMPARED
    prefiltering, comparing, aligning, searching = [], [], [], []
    share = max(1, round(PENETRATION_RATE * count))
    probes = [few[k * len(few) // PROBES] for k in range(PROBES)]
    for k, probe in enumerate(probes):
        first = k * COMPARED % (len(few) - COMPARED)
        part = partial(MATCHER.similarities, probe, few, first, first + COMPARED)
        comparing.append(seconds(part) / COMPARED)
        with without_prefilter():
            aligning.append(seconds(part) / COMPARED)
        score = np.zeros(count)
        spent = 0.0
        for begin in range(0, count, len(few)):  # the same prints stand for all
            start = time.process_time()
            score[begin : begin + len(few)] = normalized_prefilter_scores(probe, few)
            spent += time.process_time() - start
        prefiltering.append(spent / count)
        start = time.process_time()
        chosen = np.sort(np.argsort(-score, kind="stable")[:share]) % len(few)
        for at in range(0, share, COMPARED):
            MATCHER.similarities(probe, few.take(chosen[at : at + COMPARED]))
        searching.append((spent + time.process_time() - start) / count)
    micro = 1e6
    descriptors = (few.direction_bin, few.neighbour_bits, few.orientation_bins)
    return {
        "prints": count,
        "encoding_us": micro * encoding,
        "prefilter_us": micro * float(np.median(prefiltering)),
        "search_us": micro * float(np.median(searching)),
        "comparing_all_us": micro * float(np.median(comparing)),
        "aligning_all_us": micro * float(np.median(aligning)),
        "share_of_time": float(np.median(searching) / np.median(aligning)),
        "descriptor_bytes": sum(array.nbytes for array in descriptors) / len(few),
        "print_bytes": few.nbytes / len(few),
    }


def found(kind: Kind, more: PackedTemplates) -> dict[str, float | str]:
    """Return the share of the mates found by comparing all that candidate lists contain."""
    own = PackedTemplates.pack(MATCHER.prepare(template) for template in kind.templates)
    many = PackedTemplates.concatenate([own, more])
    finger = np.array([hash(f) for f in kind.finger])
    right, ranks = 0, []
    for k in range(len(own)):
        probe = own[k]
        score = normalized_prefilter_scores(probe, many)
        others = np.flatnonzero(np.concatenate([finger != finger[k], np.ones(len(more), bool)]))
        mates = np.flatnonzero(finger == finger[k])
        mates = mates[mates != k]
        similarity = MATCHER.similarities(probe, many)
        for mate in mates[similarity[mates] > similarity[others].max()].tolist():
            right += 1
            ranks.append((score[others] >= score[mate]).mean())
    shares = np.array(ranks or [1.0])
    return {
        "prints": kind.name,
        "gallery": len(many),
        "mates": right,
        "recall": float((shares <= PENETRATION_RATE).mean()),
        "recall_2_percent": float((shares <= 0.02).mean()),
        "share_for_99_percent": float(np.quantile(shares, 0.99, method="higher")),
    }


def kinds(folders: Sequence[Path]) -> list[Kind]:
    """Return the probes by kind."""
    rng = np.random.default_rng(7)
    samples = sample_templates()[::IMPRESSIONS]
    copies = [(k, t) for k, t in enumerate(samples) for _ in range(COPIES)]
    worn = [replace(t, minutiae=moved(t, rng, SHARE_KEPT)) for _, t in copies]
    made = [Kind("copies of the sample prints", worn, [k for k, _ in copies])]
    for found_set in extract_datasets(load_datasets(folders)) if folders else []:
        pairs = zip(found_set.dataset.impressions, found_set.extractions, strict=True)
        kept = [(i.finger, e.template) for i, e in pairs if e.template is not None]
        made.append(Kind(found_set.dataset.name, [t for _, t in kept], [f for f, _ in kept]))
    return made


@click.command(cls=Command)
@click.argument("folders", metavar="[DIR]...", nargs=-1, type=PATH)
@click.option("--most", default=COUNTS[-1], show_default=True, help="Largest number of prints.")
@json_file
@click.pass_context
def main(
    context: click.Context, folders: tuple[Path, ...], most: int, json_file: Path | None
) -> None:
    """Measure searches of large galleries by a candidate list: time, memory, pre-selection errors.

    The gallery's prints are recombined from mirrored ones: the minutiae of one print on one side of
    a line and of another on the other, slightly moved and turned, so that none is a mate of a
    probe. For 10,000, 100,000 and 1,000,000 of them (or fewer, by --most) are printed: processor
    time a print of encoding the bit descriptors, of the prefilter, and of the whole search with its
    comparisons, against that of comparing all, and of aligning all whatever their descriptors,
    measured in turn; bytes a print. 5,000 of the prints are different and are repeated in a larger
    gallery.

    Then the pre-selection error is measured on disturbed copies of the sample prints and on each
    FVC-style database DIR: each print is searched in a gallery of one mate, all prints of other
    fingers, and recombined ones, for each of its mates that comparing all finds at rank 1. The exit
    status is 1 where a search of 100,000 prints takes more than a tenth of the time of aligning
    all, or less than 99 % of the mates are in the candidate list.
    """
    if json_file:
        check_writable(json_file)
    rng = np.random.default_rng(40)
    given = kinds(folders)
    templates = [mirrored(t) for kind in given for t in kind.templates]
    few = PackedTemplates.pack(
        MATCHER.prepare(recombined(templates, rng)) for _ in range(DIFFERENT)
    )
    speed = [times(few, count) for count in COUNTS if count <= most]
    recall = [found(kind, few.take(np.arange(RECOMBINED))) for kind in given]
    results = {"penetration_rate": PENETRATION_RATE, "speed": speed, "recall": recall}
    click.echo(format_searching(results))
    mates = sum(int(row["mates"]) for row in recall)
    share = sum(int(row["mates"]) * float(row["recall"]) for row in recall) / max(1, mates)
    click.echo(f"\nin the candidate list: {share:.4f} of all mates (at least {MIN_RECALL})")
    if json_file:
        write_json(json_file, results)
    largest = [t["share_of_time"] for t in speed if t["prints"] >= 100_000]
    slow = bool(largest) and max(largest) > MAX_SHARE_OF_TIME
    context.exit(int(slow or share < MIN_RECALL))


if __name__ == "__main__":
    main()
