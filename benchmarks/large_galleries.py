#!/usr/bin/env python3
"""Search large galleries by a shortlist: time, memory, and how many prints it loses.

    .venv/bin/python benchmarks/large_galleries.py [--most 1000000] [--json FILE] [DIR...]

The gallery's prints are recombined from mirrored ones: the minutiae of one on one side of a line
and of another on the other, moved and turned a little; so none is a mate of what is looked for.
For 10,000, 100,000 and 1,000,000 of them (or as many as `--most` allows): processor time a print
of making the codes, of weighing them, and of the whole search with its comparisons, against that
of comparing all, and of laying all in full, whatever their codes say, measured in turn; bytes a
print. Of these, 5,000 are different, and stand for all of a larger gallery.

Then what shortlists lose, in disturbed copies of the sample prints and in each FVC-style database
DIR: each print is looked for in a gallery of one mate, all prints of other fingers, and recombined
ones, for each of its mates that comparing all finds at rank 1. The exit status is 1 where a search
of 100,000 prints takes more than a tenth of laying all, or 99 % are not in the shortlist.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from disturbed_prints import sample_templates
from one_to_many import MOVE_PX, SHARE_KEPT, TURN_RAD, without_prefilter

from fpmatch.evaluation.extraction import extract_datasets
from fpmatch.evaluation.run import load_datasets
from fpmatch.gallery.identify import PENETRATION_RATE
from fpmatch.gallery.search import Search
from fpmatch.matching.bit_descriptors import BitDescriptors, code
from fpmatch.matching.candidate_list import normalized_prefilter_scores
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.packed_templates import PackedTemplates
from fpmatch.minutiae import Minutiae, RidgeField, Template

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

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
    """Hold prints of one kind: templates, and whose they are."""

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
    """Return a print as the mirror shows it: of another finger."""
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
    """Return a print of parts of two: what lies on either side of a line."""
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


def coded(print_: PreparedTemplate) -> BitDescriptors:
    """Return the codes of a print, made anew."""
    return code(print_.points, print_.quality, print_.neighbourhoods, print_.region)


def times(few: PackedTemplates, count: int) -> dict[str, float]:
    """Return processor time, in microseconds a print, of a search of so many prints."""
    coding = seconds(lambda: [coded(few[k]) for k in range(COMPARED)])
    coding = (coding - seconds(lambda: [few[k] for k in range(COMPARED)])) / COMPARED
    weighing, comparing, aligning, searching = [], [], [], []
    share = max(1, round(PENETRATION_RATE * count))
    probes = [few[k * len(few) // PROBES] for k in range(PROBES)]
    for k, probe in enumerate(probes):
        first = k * COMPARED % (len(few) - COMPARED)
        part = partial(MATCHER.similarities, probe, few, first, first + COMPARED)
        comparing.append(seconds(part) / COMPARED)
        with without_prefilter():
            aligning.append(seconds(part) / COMPARED)
        standing = np.zeros(count)
        spent = 0.0
        for begin in range(0, count, len(few)):  # the same prints stand for all
            start = time.process_time()
            standing[begin : begin + len(few)] = normalized_prefilter_scores(probe, few)
            spent += time.process_time() - start
        weighing.append(spent / count)
        start = time.process_time()
        chosen = np.sort(np.argsort(-standing, kind="stable")[:share]) % len(few)
        for at in range(0, share, COMPARED):
            MATCHER.similarities(probe, few.take(chosen[at : at + COMPARED]))
        searching.append((spent + time.process_time() - start) / count)
    micro = 1e6
    return {
        "prints": count,
        "coding_us": micro * coding,
        "weighing_us": micro * float(np.median(weighing)),
        "search_us": micro * float(np.median(searching)),
        "comparing_all_us": micro * float(np.median(comparing)),
        "laying_all_us": micro * float(np.median(aligning)),
        "share_of_time": float(np.median(searching) / np.median(aligning)),
        "code_bytes": (few.turn.nbytes + few.around.nbytes + few.along.nbytes) / len(few),
        "print_bytes": few.nbytes / len(few),
    }


def found(kind: Kind, more: PackedTemplates) -> dict[str, float | str]:
    """Return how many of the mates that comparing all finds are in the shortlist."""
    own = PackedTemplates.pack(MATCHER.prepare(template) for template in kind.templates)
    many = PackedTemplates.concatenate([own, more])
    search = Search(MATCHER, np.arange(len(many)), many)
    finger = np.array([hash(f) for f in kind.finger])
    right, ranks = 0, []
    for k in range(len(own)):
        probe = own[k]
        standing = normalized_prefilter_scores(probe, many)
        others = np.flatnonzero(np.concatenate([finger != finger[k], np.ones(len(more), bool)]))
        mates = np.flatnonzero(finger == finger[k])
        mates = mates[mates != k]
        similarity = search.similarities(probe)
        for mate in mates[similarity[mates] > similarity[others].max()].tolist():
            right += 1
            ranks.append((standing[others] >= standing[mate]).mean())
    shares = np.array(ranks or [1.0])
    return {
        "prints": kind.name,
        "gallery": len(many),
        "right": right,
        "recall": float((shares <= PENETRATION_RATE).mean()),
        "recall_2_percent": float((shares <= 0.02).mean()),
        "share_for_99_percent": float(np.quantile(shares, 0.99, method="higher")),
    }


def kinds(folders: Sequence[Path]) -> list[Kind]:
    """Return the prints that are looked for."""
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


def main() -> int:
    """Run the script; return its exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--most", type=int, default=COUNTS[-1], help="prints, at most")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to this file")
    parser.add_argument("folders", nargs="*", type=Path, metavar="DIR", help="FVC-style databases")
    options = parser.parse_args()
    rng = np.random.default_rng(40)
    given = kinds(options.folders)
    templates = [mirrored(t) for kind in given for t in kind.templates]
    few = PackedTemplates.pack(
        MATCHER.prepare(recombined(templates, rng)) for _ in range(DIFFERENT)
    )
    print(
        f"{'prints':>9}{'code us':>9}{'weigh us':>10}{'search us':>11}{'all us':>8}{'laid us':>9}"
        f"{'share':>8}{'code bytes':>12}{'print bytes':>13}"
    )
    speed = []
    for count in [c for c in COUNTS if c <= options.most]:
        t = times(few, count)
        speed.append(t)
        print(
            f"{count:9}{t['coding_us']:9.2f}{t['weighing_us']:10.2f}{t['search_us']:11.2f}"
            f"{t['comparing_all_us']:8.1f}{t['laying_all_us']:9.1f}{t['share_of_time']:8.3f}"
            f"{t['code_bytes']:12.0f}{t['print_bytes']:13.0f}",
            flush=True,
        )
    print(f"\n{'looked for':<30}{'gallery':>9}{'right':>7}{'in shortlist':>14}{'of 2 %':>8}")
    lost = []
    for kind in given:
        f = found(kind, few.take(np.arange(RECOMBINED)))
        lost.append(f)
        print(
            f"{f['prints']:<30}{f['gallery']:>9}{f['right']:>7}{f['recall']:>14.4f}"
            f"{f['recall_2_percent']:>8.4f}",
            flush=True,
        )
    right = max(1, sum(f["right"] for f in lost))
    recall = sum(f["right"] * f["recall"] for f in lost) / right
    print(f"in a shortlist of {PENETRATION_RATE:.0%}: {recall:.4f} (at least {MIN_RECALL})")
    largest = [t["share_of_time"] for t in speed if t["prints"] >= 100_000]
    if options.json:
        figures = {"shortlist_share": PENETRATION_RATE, "speed": speed, "recall": lost}
        options.json.write_text(f"{json.dumps(figures, indent=1)}\n", encoding="utf-8")
    slow = bool(largest) and max(largest) > MAX_SHARE_OF_TIME
    return int(slow or recall < MIN_RECALL)


if __name__ == "__main__":
    sys.exit(main())
