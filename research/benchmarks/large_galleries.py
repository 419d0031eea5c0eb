#!/usr/bin/env python3
"""Measure searches of large galleries: cost, prints compared, mates that a search loses.

.venv/bin/python research/benchmarks/large_galleries.py --keep FOLDER [--prints 1000000]...
    [--json FILE] DIR...

A gallery has synthetic templates of different fingers, and the first print of each finger of the
databases DIR and of some other synthetic fingers. Other prints of these fingers are searched for:
at each effort, and with all prints compared. Galleries are kept in FOLDER.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from hashlib import sha256
from itertools import chain, islice
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import repository  # noqa: F401
from scipy.spatial import Delaunay

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.search.search import EFFORTS
from fpmatch.gallery.search.whole import WholeSearch
from fpmatch.lab.synthesis.sensor import SENSORS
from research.commands import PATH, Command, json_file, print_and_write
from research.databases import extract_folders, prints_of
from research.tables import format_searching
from research.templates.making import make_templates

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.search.search import Search
    from fpmatch.templates.minutiae import Template

SIZES = (10_000, 100_000, 1_000_000)
SEED = 22
MADE_FINGERS, MADE_IMPRESSIONS = 40, 4  # of synthetic mates
PROBES = 98  # of each database, at most
ALONE = 10  # probes without a mate, whose searches are timed
BATCH = 1000  # entries a transaction
AT_ONCE = 32  # fingers of each sensor that are made together
POINTS, TRIANGULATIONS = 40, 200


@dataclass
class Kind:
    """Prints of one database: one of each finger that is enrolled, and others by its name."""

    name: str
    enrolled: dict[str, Template] = field(default_factory=dict)
    probes: list[tuple[str, Template]] = field(default_factory=list)

    def add(self, finger: str, template: Template) -> None:
        """Add the next print of a finger."""
        if finger not in self.enrolled:
            self.enrolled[finger] = template
        elif len(self.probes) < PROBES:
            self.probes.append((finger, template))


def triangulation() -> float:
    """Return the processor time of one call of scipy's Delaunay with 40 points."""
    sets = np.random.default_rng(40).random((TRIANGULATIONS, POINTS, 2))
    start = time.process_time()
    for points in sets:
        Delaunay(points)
    return (time.process_time() - start) / TRIANGULATIONS


def made(first: int, count: int, impressions: int = 1) -> Iterator[tuple[str, Template]]:
    """Yield templates of synthetic fingers, of all sensors in turn, with their names."""
    names, fingers = list(SENSORS), range(first, first + count)
    for start in range(0, count, AT_ONCE * len(names)):
        block = fingers[start : start + AT_ONCE * len(names)]
        templates = {
            sensor: make_templates(
                SEED,
                [finger for finger in block if finger % len(names) == turn],
                impressions,
                sensors=[sensor],
            )
            for turn, sensor in enumerate(names)
        }
        for finger in block:
            for template in islice(templates[names[finger % len(names)]], impressions):
                yield f"made-{finger}", template


def kinds_of(folders: Sequence[Path]) -> list[Kind]:
    """Return the prints that have mates: synthetic ones, and those of databases."""
    synthetic = Kind("synthetic")
    for finger, template in made(2**40, MADE_FINGERS, MADE_IMPRESSIONS):
        synthetic.add(finger, template)
    kinds = [synthetic]
    for extracted in extract_folders(folders):
        kinds.append(Kind(extracted.dataset.name))
        for shown, template in prints_of(extracted):
            kinds[-1].add(f"{extracted.dataset.name} {shown.finger}", template)
    return kinds


def fill(gallery: Gallery, mates: Sequence[tuple[str, Template]], prints: int) -> None:
    """Enrol what a gallery lacks: the mates, then synthetic prints of other fingers."""
    rows = chain(mates, made(0, prints - len(mates)))
    wanted = islice(rows, len(gallery), prints)
    while batch := list(islice(wanted, BATCH)):
        gallery.add(
            [
                NewEntry(Label(name), name, sha256(name.encode()).digest(), template)
                for name, template in batch
            ]
        )


def taken(
    search: Search, probes: Sequence[Template], effort: int, call_s: float
) -> tuple[list[int], dict[str, float]]:
    """Return the entry that each search ranks first (0: none), and the mean cost of a search."""
    first, compared, start = [], 0, time.process_time()
    for probe in probes:
        found = identify(search, probe, effort=effort, workers=1)
        first.append(found.numbers[0] if found.candidates else 0)
        compared += found.compared
    each = (time.process_time() - start) / len(probes)
    return first, {
        "compared": round(compared / len(probes)),
        "ms": round(1e3 * each, 1),
        "calls": round(each / call_s, 1),
    }


def measure(gallery: Gallery, kinds: Sequence[Kind], number_of: dict[str, int]) -> dict[str, Any]:
    """Return the cost of searches without and with a mate, and the mates that they lose."""
    prints, call_s = len(gallery), triangulation()
    alone = [template for _, template in made(2**41, ALONE)]
    search = open_search(gallery)
    every = WholeSearch.of([template for _, template in gallery.templates()], search.matcher)
    whole = [
        [identify(every, probe).numbers[:1] == [number_of[f]] for f, probe in k.probes]
        for k in kinds
    ]
    speed, losses = [], []
    for effort in EFFORTS:
        _, without = taken(search, alone, effort, call_s)
        costs = []
        for kind, by_all in zip(kinds, whole, strict=True):
            first, cost = taken(search, [probe for _, probe in kind.probes], effort, call_s)
            right = [one == number_of[f] for one, (f, _) in zip(first, kind.probes, strict=True)]
            lost = sum(found and not ours for found, ours in zip(by_all, right, strict=True))
            costs.append(cost)
            losses.append(
                {
                    **{"name": kind.name, "prints": prints, "effort": effort},
                    **{"mates": len(kind.probes), "found": sum(by_all)},
                    "lost": lost / max(1, sum(by_all)),
                }
            )
        mated = {f"mated_{key}": float(np.mean([c[key] for c in costs])) for key in without}
        speed.append({"prints": prints, "effort": effort, **without, **mated})
    return {"speed": speed, "loss": losses}


@click.command(cls=Command)
@click.argument("folders", metavar="[DIR]...", nargs=-1, type=PATH)
@click.option("--keep", type=PATH, required=True, help="Folder of the galleries.")
@click.option("--prints", "sizes", multiple=True, type=click.IntRange(100), default=SIZES)
@json_file
def main(
    folders: tuple[Path, ...], keep: Path, sizes: tuple[int, ...], json_file: Path | None
) -> None:
    """Measure searches of galleries of so many prints; a million take hours.

    Times are processor times of one thread, also in calls of scipy's Delaunay with 40 points. A
    mate is lost where comparing all prints ranks it first and the search does not.
    """
    keep.mkdir(parents=True, exist_ok=True)
    kinds = kinds_of(folders)
    mates = [row for kind in kinds for row in kind.enrolled.items()]
    number_of = {finger: k for k, (finger, _) in enumerate(mates, start=1)}
    results: dict[str, list[Any]] = {"speed": [], "loss": []}
    for prints in sizes:
        with open_gallery(keep / f"{len(mates)}-{prints}.db", create=True) as gallery:
            fill(gallery, mates, prints)
            for name, rows in measure(gallery, kinds, number_of).items():
                results[name] += rows
        click.echo(f"{prints:,} prints", err=True)
    print_and_write(format_searching(results), results, json_file)


if __name__ == "__main__":
    main()
