#!/usr/bin/env python3
"""Measure how often pairs of different fingers reach the highest scores, in a large gallery.

Probes without a mate are searched for in a gallery of synthetic templates. A search compares the
prints that its first stages pass on. What they lose is measured where a part of the gallery is
compared.

.venv/bin/python research/benchmarks/impostor_tail.py --keep FOLDER [--prints 458752]
    [--probes 440] [--alone 340] [--json docs/data/impostor_tail.json] DIR...
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any
from zlib import crc32

import click
import numpy as np
import repository  # noqa: F401
from large_galleries import Cost, search
from made_gallery import PART, SEED, segments_of, template_of, template_rows

from fpmatch.gallery.index.loss import search_plan
from fpmatch.gallery.index.print_segment import MOST_PRINTS, prepare_prints
from fpmatch.gallery.index.prints.compare import similarities
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.all_pairs import compare_all_pairs
from research.commands import PATH, Command, json_file, print_and_write
from research.databases import extract_folders, prints_of, without_ridges
from research.tables.identification import format_tail

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from fpmatch.gallery.index.print_segment import PrintSegment
    from fpmatch.templates.minutiae import Template

    Look = Callable[[Template], tuple[np.ndarray, np.ndarray]]

PROBE = 2**40  # number of the first finger of the probes
LOSS = 0.01
COMPARED = 1_000  # prints of a search, more than its plan has
LEAST = 6.0  # similarity of the pairs that are kept
STORED = 8.0  # of those that are written to the file
CHECKED, CHECKED_WITH = 50, 16_384  # probes that are compared with so many prints, index or not
ALONE = ", minutiae alone"


class Tail:
    """A gallery in segments, and the searches of it; rows are (probe, place, similarity)."""

    def __init__(self, keep: Path, prints: int) -> None:
        self.keep = keep
        parts = range(-(-prints // PART))
        self.segments: list[PrintSegment] = [s for part in parts for s in segments_of(keep, part)]
        self.rows = [template_rows(keep, part) for part in parts]
        self.prints = sum(map(len, self.segments))
        plan = search_plan(LOSS, self.prints)
        self.plan = replace(plan, by_descriptors=max(plan.by_descriptors, COMPARED))

    def kept(self, name: str, probes: Sequence[Template], look: Look) -> np.ndarray:
        """Return the rows of some probes; read them where an earlier run has stored them."""
        path = self.keep / _file_name("rows", name, f"{self.prints}.npz")
        rows = list(np.load(path).values()) if path.exists() else []
        for k in range(len(rows), len(probes)):
            place, similarity = look(probes[k])
            high = np.flatnonzero(similarity >= LEAST)
            rows.append(np.column_stack([np.full(len(high), k), place[high], similarity[high]]))
            if k % 20 == 19 or k == len(probes) - 1:
                np.savez(path, *rows)
                click.echo(f"{name}: {k + 1} of {len(probes)} probes", err=True)
        return np.concatenate([np.empty((0, 3)), *rows[: len(probes)]])

    def searched(self, template: Template) -> tuple[np.ndarray, np.ndarray]:
        """Return places and similarities of the prints that a search compares."""
        result = search(self.segments, MATCHER.prepare(template), self.plan, Cost())
        return result.place, result.similarities

    def searched_alone(self, template: Template) -> tuple[np.ndarray, np.ndarray]:
        """Return the same of minutiae alone, on both sides."""
        probe = MATCHER.prepare(without_ridges(template))
        place = search(self.segments, probe, self.plan, Cost()).place
        return place, similarities(MATCHER, probe, self._alone(place))

    @cached_property
    def part(self) -> np.ndarray:
        """Places of prints, evenly chosen, that are all compared with a probe."""
        return np.arange(0, self.prints, max(1, self.prints // CHECKED_WITH))

    @cached_property
    def _part(self) -> PreparedPrints:
        return prepare_prints(self.segments, *divmod(self.part, MOST_PRINTS))

    @cached_property
    def _part_alone(self) -> PreparedPrints:
        return self._alone(self.part)

    def compared(self, template: Template) -> tuple[np.ndarray, np.ndarray]:
        """Return places and similarities of all prints of the `part`."""
        return self.part, similarities(MATCHER, MATCHER.prepare(template), self._part)

    def compared_alone(self, template: Template) -> tuple[np.ndarray, np.ndarray]:
        """Return the same of minutiae alone, on both sides."""
        probe = MATCHER.prepare(without_ridges(template))
        return self.part, similarities(MATCHER, probe, self._part_alone)

    def of_one_sensor(self, rows: np.ndarray) -> np.ndarray:
        """Return the rows whose probe and print are of one sensor."""
        return rows[rows[:, 0] % len(SENSORS) == rows[:, 1] // PART % len(SENSORS)]

    def _alone(self, places: np.ndarray) -> PreparedPrints:
        """Return prints without their ridges."""
        templates = (template_of(self.rows[p // PART], p % PART) for p in places.tolist())
        return PreparedPrints.pack(MATCHER.prepare(without_ridges(t)) for t in templates)


def synthetic_probes(count: int) -> list[Template]:
    """Return templates of fingers that are in no gallery, of all sensors in turn."""
    names = list(SENSORS)
    turns = [range(PROBE + s, PROBE + count, len(names)) for s in range(len(names))]
    made = [make_templates(SEED, turn, sensors=[n]) for turn, n in zip(turns, names, strict=True)]
    return [next(made[k % len(names)]) for k in range(count)]


def synthetic_kind(
    name: str, rows: np.ndarray, compared: np.ndarray, probes: int, tail: Tail
) -> dict[str, Any]:
    """Return the highest similarities of the searches, and how many of all pairs they have."""
    keys = {(int(k), int(p)) for k, p, _ in rows}
    known = np.array([(int(k), int(p)) in keys for k, p, _ in compared], bool)
    return {
        "name": name,
        "pairs": probes * tail.prints,
        "similarity": highest(rows[:, 2]),
        "compared_pairs": CHECKED * len(tail.part),
        "compared": highest(compared[:, 2]),
        "searched": highest(compared[known, 2]),
    }


def real_kinds(keep: Path, folders: Sequence[Path]) -> list[dict[str, Any]]:
    """Return the highest similarities of all impostor pairs of some databases."""
    sets = extract_folders(folders, 1) if folders else []
    shown = [(k, *row) for k, one in enumerate(sets) for row in prints_of(one)]
    templates = [template for _, _, template in shown]
    _, finger = np.unique([f"{k}|{i.finger}" for k, i, _ in shown], return_inverse=True)
    database = np.array([k for k, _, _ in shown])
    a, b = np.triu_indices(len(templates), 1)
    same, impostor = database[a] == database[b], finger[a] != finger[b]
    order = crc32("|".join("/".join(one.path.parts[-3:]) for _, one, _ in shown).encode())
    kinds = []
    for form in ("", ALONE) if folders else ():
        path = keep / _file_name("real" + form, f"{order:08x}.npy")
        if not path.exists():
            of = [without_ridges(template) for template in templates] if form else templates
            np.save(path, compare_all_pairs(of, workers=1))
        similarity = np.load(path)
        for name, which in (("one database", same), ("two databases", ~same)):
            pairs = impostor & which
            kinds.append({"name": f"real, of {name}{form}", "pairs": int(pairs.sum()),
                          "similarity": highest(similarity[pairs])})  # fmt: skip
    return kinds


def _file_name(*parts: str) -> str:
    return "-".join(parts).replace(", ", "-").replace(" ", "-")


def highest(similarity: np.ndarray) -> list[float]:
    """Return the similarities that are stored, in descending order."""
    kept = np.sort(similarity[similarity >= STORED])[::-1]
    return [float(x) for x in kept.round(4)]


@click.command(cls=Command)
@click.argument("folders", nargs=-1, type=PATH)
@click.option("--keep", type=PATH, required=True, help="Folder of the gallery.")
@click.option("--prints", default=7 * PART, show_default=True, help="Of the gallery.")
@click.option("--probes", default=440, show_default=True, help="Synthetic templates to search for.")
@click.option("--alone", default=340, show_default=True, help="Of them on minutiae alone, too.")
@json_file
def main(
    folders: tuple[Path, ...],
    keep: Path,
    prints: int,
    probes: int,
    alone: int,
    json_file: Path | None,
) -> None:
    """Search for synthetic templates without mates; compare the prints of databases DIR."""
    tail = Tail(keep, prints)
    made = synthetic_probes(probes)
    looks = {
        "synthetic": (made, tail.searched),
        f"synthetic{ALONE}": (made[:alone], tail.searched_alone),
        "compared": (made[:CHECKED], tail.compared),
        f"compared{ALONE}": (made[:CHECKED], tail.compared_alone),
    }
    rows = {name: tail.kept(name, of, look) for name, (of, look) in looks.items()}
    kinds = []
    for form, count in (("", probes), (ALONE, alone)):
        searched, compared = rows[f"synthetic{form}"], rows[f"compared{form}"]
        kinds.append(synthetic_kind(f"synthetic{form}", searched, compared, count, tail))
        high = highest(tail.of_one_sensor(searched)[:, 2])
        pairs = kinds[-1]["pairs"] // len(SENSORS)
        kinds.append({**kinds[-1], "name": f"synthetic, of one sensor{form}", "pairs": pairs,
                      "similarity": high})  # fmt: skip
    results = {"gallery": tail.prints, "kinds": kinds + real_kinds(keep, folders)}
    print_and_write(format_tail(results), results, json_file)


if __name__ == "__main__":
    main()
