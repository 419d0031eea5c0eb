#!/usr/bin/env python3
"""Measure the gain of enrolling several touches of a finger on a small sensor.

.venv/bin/python research/benchmarks/touches.py [DIR]... [--page]
"""

from __future__ import annotations

import sys
import tempfile
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click
import numpy as np
from numpy.random import default_rng
from repository import ROOT

from fpmatch.gallery.fingers.finger import Finger, fused_score
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.synthesis.database import make_database
from fpmatch.lab.synthesis.plan import plain_sensor
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher
from research.commands import PATH, Command, workers
from research.databases import extract_folders, prints_of
from research.markdown import markdown_table, write_marked_block

if TYPE_CHECKING:
    from collections.abc import Sequence

PAGE: Final = ROOT / "docs" / "tables" / "accuracy.md"
TOUCHES: Final = (1, 2, 5, 10, 20)
WAYS: Final = ("best", "fused", "consolidated", "finger")
DRAWS: Final = 5
SIDE_PX: Final = 160
PER_FINGER: Final = 24
SEEDS: Final = {"normal": 911, "hard": 912}
THRESHOLD: Final = 40.0


@dataclass
class Prints:
    """Templates of a database, and prepared ones, by finger."""

    templates: dict[int, list] = field(default_factory=lambda: defaultdict(list))
    prepared: dict[int, list] = field(default_factory=lambda: defaultdict(list))


@dataclass
class Scores:
    """Scores of each way, of genuine and of impostor comparisons."""

    genuine: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    impostor: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))


MATCHER: Final = get_matcher(DEFAULT_MATCHER)
CURVE: Final = load_calibration(DEFAULT_MATCHER)


def extracted_prints(folder: Path, workers: int | None) -> tuple[str, Prints]:
    """Extract a database; touches without a template are left out."""
    (extracted,) = extract_folders([folder], workers)
    found = Prints()
    for impression, template in prints_of(extracted):
        found.templates[impression.finger].append(template)
        found.prepared[impression.finger].append(MATCHER.prepare(template))
    return extracted.dataset.name, found


def measure(prints: Prints, count: int, scores: Scores, others: list, seed: int | None) -> None:
    """Enrol `count` touches of each finger, and compare all others with each."""
    order = {}
    for finger, templates in prints.templates.items():
        rng = None if seed is None else default_rng([seed, finger])
        every = np.arange(len(templates))
        order[finger] = every if rng is None else rng.permutation(every)
    for enrolled, templates in prints.templates.items():
        finger = Finger.of([templates[k] for k in sorted(order[enrolled][:count])], MATCHER, CURVE)
        for shown, prepared in prints.prepared.items():
            side = scores.genuine if shown == enrolled else scores.impostor
            for k in order[shown][count:]:
                compare(finger, prepared[k], side)
        for probe in others:
            compare(finger, probe, scores.impostor)


def compare(finger: Finger, probe: object, side: dict[str, list[float]]) -> None:
    """Add the scores that a probe has in each way."""
    found = finger.compare(probe)
    best = float(found.scores.max())
    side["best"].append(best - 10.0 * np.log10(len(found.scores)))
    side["fused"].append(fused_score(found.scores))
    # touches that match no other stand for themselves
    side["consolidated"].append(float(found.consolidated.max(initial=0.0)))
    side["finger"].append(found.score)


def row_of(name: str, count: int, scores: Scores) -> list[str]:
    """Return a row of the table."""
    cells = [name, str(count), str(len(scores.genuine["best"])), str(len(scores.impostor["best"]))]
    for way in WAYS:
        rate = error_rates(scores.genuine[way], scores.impostor[way]).fmr1000
        undefined = rate is None or (way == "consolidated" and count == 1)
        cells.append("" if undefined else f"{100 * rate:.2f}")
    fmr = np.mean(np.array(scores.impostor["finger"]) >= THRESHOLD)
    fnmr = np.mean(np.array(scores.genuine["finger"]) < THRESHOLD)
    return [*cells, f"{100 * fmr:.3f} / {100 * fnmr:.2f}"]


def table(folders: Sequence[Path], data: Path, fingers: int, workers: int | None) -> str:
    """Measure everything; return the table."""
    rows = [["touches", "enrolled", "genuine", "impostor", *WAYS, "FMR / FNMR at score 40"]]
    synthetic: dict[str, Prints] = {}
    for preset, seed in SEEDS.items():
        folder = data / f"{preset}-{seed}"
        make_database(
            folder,
            fingers=fingers,
            impressions=PER_FINGER,
            preset=preset,
            seed=seed,
            sensors=(plain_sensor(SIDE_PX, SIDE_PX),),
            workers=workers,
        )
        _, synthetic[preset] = extracted_prints(folder, workers)
    named = [(f"synthetic, {preset}", prints, [], [None]) for preset, prints in synthetic.items()]
    impostors = [one for prints in synthetic["normal"].prepared.values() for one in prints]
    for folder in folders:
        name, prints = extracted_prints(folder, workers)
        named.append((f"{name}, the first", prints, impostors, [None]))
        named.append((f"{name}, drawn", prints, impostors, list(range(DRAWS))))
    for name, prints, others, draws in named:
        for count in TOUCHES:
            scores = Scores()
            for seed in draws:
                measure(prints, count, scores, others, seed)
            rows.append(row_of(name, count, scores))
            print(" | ".join(rows[-1]), file=sys.stderr, flush=True)
    return markdown_table(rows)


@click.command(cls=Command)
@click.argument("folders", metavar="[DIR]...", nargs=-1, type=PATH)
@click.option("--fingers", default=30, show_default=True, help="Synthetic fingers.")
@click.option("--data", type=PATH, help="Folder where synthetic databases are kept.")
@workers
@click.option("--page", is_flag=True, help="Write the table to docs/tables/accuracy.md.")
def main(
    folders: tuple[Path, ...], fingers: int, data: Path | None, workers: int | None, page: bool
) -> None:
    """Measure the error rates of fingers by the number of touches that are enrolled.

    Of every finger 1, 2, 5, 10 and 20 touches are enrolled, and each other touch is compared
    with each finger, in four ways: by the best score, less 10 log10 of the number of touches
    ("best"); by the fused score of the touches ("fused"); by the best consolidated template
    alone ("consolidated"); and as the package does, by touches and consolidated templates
    together ("finger"). FNMR is at the threshold that 1 impostor in 1,000 reaches; beside it
    stand, for the package's way, the FMR and FNMR that the score 40 (stated FMR 0.01 %) has in
    truth.

    The databases are synthetic fingers on a sensor of 160 by 160 pixels, made from seeds, and
    each DIR, an FVC-style folder of a small sensor, twice: with the first touches enrolled, and
    with some drawn at random, five draws together. Impostors of a DIR are its other fingers and
    synthetic prints. One core takes about twelve minutes. --page puts the tables between the
    marks in docs/tables/accuracy.md.
    """
    with tempfile.TemporaryDirectory() as folder:
        text = table(folders, data or Path(folder), fingers, workers)
    if page:
        write_marked_block(PAGE, "touches", text)
    click.echo(text)


if __name__ == "__main__":
    main()
