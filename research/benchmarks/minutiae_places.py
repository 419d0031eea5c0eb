#!/usr/bin/env python3
"""Measure where in prints minutiae are found, missed and spurious.

.venv/bin/python research/benchmarks/minutiae_places.py --synthetic
    [--against IMAGES MINUTIAE NAME]...
"""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np
import repository  # noqa: F401

from fpmatch.errors import DatasetError
from fpmatch.formats.files import load_record
from fpmatch.image.io.read import read_image
from fpmatch.lab.evaluation.ground_truth.truth import TRUTH_FOLDER, load_truth
from research.commands import Command, json_file, print_and_write, synthetic_folder, workers
from research.databases import TEST_SEED, extract_folders, synthetic_sets
from research.experiments.minutiae_places import (
    PLACES,
    PlaceCounts,
    count_by_place,
    format_places,
    places_of,
)

if TYPE_CHECKING:
    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.templates.minutiae import Minutiae

Counts = dict[str, PlaceCounts]
Known = tuple["Minutiae", "np.ndarray", "np.ndarray | None"]  # minutiae, visible, cores


def true_minutiae(extracted: ExtractedSet) -> list[Known]:
    """Return the true minutiae of a synthetic database, and the cores, print by print."""
    dataset = extracted.dataset
    found: list[Known] = []
    for impression, truth in zip(dataset.impressions, load_truth(dataset), strict=True):
        path = (
            impression.path.parent / TRUTH_FOLDER / f"{impression.path.stem.partition('_')[0]}.json"
        )
        cores = json.loads(path.read_text(encoding="utf-8"))["cores"]
        placed = truth.from_master(np.array(cores, float).reshape(-1, 2))
        found.append((truth.minutiae, truth.visible, placed))
    return found


def minutiae_of(folder: Path, extracted: ExtractedSet) -> list[Known]:
    """Return the minutiae of another extractor, print by print."""
    found: list[Known] = []
    for impression in extracted.dataset.impressions:
        path = folder / f"{impression.path.stem}.csv"
        minutiae = load_record(path, file_format="minutiae-csv").single().template.minutiae
        found.append((minutiae, np.ones(len(minutiae), bool), None))
    return found


def counted(extracted: ExtractedSet, known: list[Known]) -> Counts:
    """Count the minutiae of a database in every place."""
    total: Counts = defaultdict(PlaceCounts)
    dataset = extracted.dataset
    rows = zip(dataset.impressions, extracted.extractions, known, strict=True)
    for impression, extraction, (minutiae, visible, cores) in rows:
        if extraction.template is None:
            raise DatasetError(f"{impression.path}: {extraction.reason}")
        grey = read_image(impression.path).pixels
        own, dpi = extraction.template.minutiae, extraction.template.dpi
        found = places_of(grey, dpi, np.vstack([own.xy, minutiae.xy]), cores)
        places = (
            {place: inside[: len(own)] for place, inside in found.items()},
            {place: inside[len(own) :] for place, inside in found.items()},
        )
        for place, counts in count_by_place(own, minutiae, visible, places).items():
            total[place] += counts
    return total


def as_json(counts: Counts) -> dict[str, dict[str, int]]:
    """Return the counts as JSON values."""
    return {place: asdict(counts[place]) for place in PLACES}


def _synthetic(kept_in: Path | None, workers: int | None) -> list[Counts]:
    """Return the counts of synthetic databases."""
    with synthetic_sets(TEST_SEED, kept_in, workers) as folders:
        sets = extract_folders(folders, workers)
        return [counted(extracted, true_minutiae(extracted)) for extracted in sets]


@click.command(cls=Command)
@click.option("--synthetic", is_flag=True, help="Make synthetic prints; their truth is known.")
@synthetic_folder
@click.option(
    "--against",
    nargs=3,
    multiple=True,
    metavar="IMAGES MINUTIAE NAME",
    help="A database, another extractor's minutiae, and its name (repeatable).",
)
@json_file
@workers
def main(
    synthetic: bool,
    prints: Path | None,
    against: tuple[tuple[str, str, str], ...],
    json_file: Path | None,
    workers: int | None,
) -> None:
    """Measure where in prints minutiae are found, missed and spurious.

    With --synthetic eight synthetic databases are made, which nothing was trained on, and their
    true minutiae are the known ones. With --against those of the extractor NAME are: IMAGES is an
    FVC-style database, MINUTIAE a folder of files FFF_M.csv with the columns x, y, theta, type and
    quality. Printed are, for the border, the core, faint, smeared and other places and for all
    together, the number of known minutiae, the share of them that is found (recall), and the share
    of the extracted ones that is known (precision), within 12 px and 22.5 degrees.
    `research.experiments.minutiae_places` defines the places; cores are known of synthetic prints
    alone.

    --json writes what ``python -m research tables accuracy --places`` reads.
    """
    if not synthetic and not against:
        raise click.UsageError("nothing to measure: give --synthetic or --against")
    rows = {}
    if synthetic:
        total: Counts = defaultdict(PlaceCounts)
        for found in _synthetic(prints, workers):
            for place, counts in found.items():
                total[place] += counts
        rows["synthetic prints"] = as_json(total)
    for images, minutiae, name in against:
        (extracted,) = extract_folders([Path(images)], workers)
        rows[f"{extracted.dataset.name}, {name}"] = as_json(
            counted(extracted, minutiae_of(Path(minutiae), extracted))
        )
    print_and_write(format_places(rows), {"rows": rows}, json_file)


if __name__ == "__main__":
    main()
