#!/usr/bin/env python3
"""Measure searches of large galleries: cost, prints compared, mates that a search loses.

.venv/bin/python research/benchmarks/large_galleries.py --keep FOLDER [--prints 1000000]...
    [--json FILE] DIR...

A gallery has synthetic templates of different fingers, and the first print of each finger of the
databases DIR and of some other synthetic fingers. Other prints of these fingers are searched for
at each effort, also turned by 90 and 180 degrees. Galleries are kept in FOLDER.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from hashlib import sha256
from itertools import chain, islice
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import repository  # noqa: F401
from scipy.spatial import Delaunay

from fpmatch import extract, read_image
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.search import EFFORTS, Search
from fpmatch.gallery.store.rows import new_entry
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.matching.calibration import load_calibration, score_to_fmr
from fpmatch.matching.result import compare_prepared
from research.commands import PATH, Command, json_file, print_and_write
from research.databases import extract_folders, prints_of
from research.tables import format_searching
from research.templates.making import make_templates

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.search.identification import Candidate
    from fpmatch.templates.minutiae import Template

SIZES = (10_000, 100_000, 1_000_000)
SEED = 22
MADE_FINGERS, MADE_IMPRESSIONS = 40, 4  # of synthetic mates
PROBES, TURNED_PROBES = 70, 10  # of each database, at most
TURNED = (0, 90, 180)  # degrees
ALONE = 10  # probes without a mate, whose searches are timed
BATCH = 1000  # entries a transaction
AT_ONCE = 32  # fingers of each sensor that are made together
POINTS, TRIANGULATIONS = 40, 200


@dataclass
class Kind:
    """Prints of one database: one of each finger that is enrolled, and others by its name.

    The probes stand under the angles, in degrees, by which their images were turned.
    """

    name: str
    enrolled: dict[str, Template] = field(default_factory=dict)
    probes: dict[int, list[tuple[str, Template]]] = field(default_factory=dict)

    def add(self, finger: str, template: Template, path: Path | None = None) -> None:
        """Add the next print of a finger, whose image has a path."""
        if finger not in self.enrolled:
            self.enrolled[finger] = template
            return
        for turned in TURNED if path is not None else (0,):
            probes = self.probes.setdefault(turned, [])
            if turned == 0 and len(probes) < PROBES:
                probes.append((finger, template))
            elif turned and len(probes) < TURNED_PROBES:
                probes.append((finger, extract_turned(path, template.dpi, turned)))


def extract_turned(path: Path, dpi: float, degrees: int) -> Template:
    """Return the template of an image, turned by a multiple of 90 degrees."""
    image = read_image(path)
    return extract(replace(image, pixels=np.rot90(image.pixels, degrees // 90).copy()), dpi)


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
        kinds.append(Kind(extracted.name))
        for shown, template in prints_of(extracted):
            finger = f"{extracted.name} {shown.finger}"
            kinds[-1].add(finger, template, shown.path)
    return kinds


def fill(gallery: Gallery, mates: Sequence[tuple[str, Template]], prints: int) -> None:
    """Enrol what a gallery lacks: the mates, then synthetic prints of other fingers."""
    enrolled = len(gallery)
    first = max(0, enrolled - len(mates))
    wanted = chain(mates[enrolled:], made(first, max(0, prints - len(mates) - first)))
    while batch := list(islice(wanted, BATCH)):
        gallery.add(
            [
                new_entry(Label(name), name, sha256(name.encode()).digest(), template)
                for name, template in batch
            ]
        )


@dataclass
class Searched:
    """The searches for the probes of one kind, turned by an angle, at one effort."""

    name: str
    turned: int
    effort: int
    first: list[Candidate] = field(default_factory=list)


def searched(
    search: Search, probes: Sequence[Template], call_s: float, *of: Any
) -> tuple[Searched, dict[str, float]]:
    """Return the first candidates of probes, and the mean cost of a search."""
    result = Searched(*of)
    compared, start = 0, time.process_time()
    for probe in probes:
        one = identify(search, probe, effort=result.effort, count=1, workers=1)
        result.first.append(one.candidates[0])
        compared += one.compared
    each = (time.process_time() - start) / len(probes)
    return result, {
        "compared": round(compared / len(probes)),
        "ms": round(1e3 * each, 1),
        "calls": round(each / call_s, 1),
    }


def lost_mates(
    searches: Sequence[Searched],
    mates: Sequence[int],
    similar: Sequence[float],
    by_chance: Sequence[float],
) -> list[dict[str, Any]]:
    """Return how many mates the searches for the same probes lose.

    `mates` are the numbers of the probes' mates, `similar` their similarities, and `by_chance` how
    many prints of the gallery are expected to be as similar. Comparing all prints would rank a mate
    first where less than one is, and none that was compared.
    """
    others = [
        max([one.first[k].similarity for one in searches if one.first[k].number != mate], default=0)
        for k, mate in enumerate(mates)
    ]
    by_all = [
        mine > other and expected < 1
        for mine, other, expected in zip(similar, others, by_chance, strict=True)
    ]
    rows = []
    for one in searches:
        missed = [c.number != mate for c, mate in zip(one.first, mates, strict=True)]
        lost = sum(can and not_first for can, not_first in zip(by_all, missed, strict=True))
        counts = {"mates": len(mates), "found": sum(by_all), "lost": lost / max(1, sum(by_all))}
        rows.append({"name": one.name, "turned": one.turned, "effort": one.effort, **counts})
    return rows


def measure(gallery: Gallery, kinds: Sequence[Kind], number_of: dict[str, int]) -> dict[str, Any]:
    """Return the cost of searches without and with a mate, and the mates that they lose."""
    size, call_s, search = {"prints": len(gallery)}, triangulation(), Search(gallery)
    calibration = load_calibration(search.matcher.name)
    alone = [template for _, template in made(2**41, ALONE)]
    speed: dict[int, dict[str, Any]] = {}
    for effort in EFFORTS:
        _, speed[effort] = searched(search, alone, call_s, "", 0, effort)
    losses, costs = [], {effort: list[dict[str, float]]() for effort in EFFORTS}
    for kind in kinds:
        for turned, probes in kind.probes.items():
            mates = [number_of[finger] for finger, _ in probes]
            templates = [probe for _, probe in probes]
            searches = []
            for effort in EFFORTS:
                one, cost = searched(search, templates, call_s, kind.name, turned, effort)
                searches.append(one)
                costs[effort].append(cost)
            similar = [
                compare_prepared(
                    search.matcher, search.matcher.prepare(probe), search.print_of(mate)
                ).similarity
                for probe, mate in zip(templates, mates, strict=True)
            ]
            by_chance = [len(gallery) * score_to_fmr(calibration.score(one)) for one in similar]
            losses += [{**size, **row} for row in lost_mates(searches, mates, similar, by_chance)]
        click.echo(f"{size['prints']:,} prints: {kind.name}", err=True)
    rows = []
    for effort, without in speed.items():
        mated = {f"mated_{key}": float(np.mean([c[key] for c in costs[effort]])) for key in without}
        rows.append({**size, "effort": effort, **without, **mated})
    return {"speed": rows, "loss": losses}


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
    mate is lost where the search does not rank it first although it is more similar to the probe
    than all others that were compared at any effort, and than all others are expected to be.
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
