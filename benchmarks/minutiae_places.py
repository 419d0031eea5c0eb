#!/usr/bin/env python3
"""Measure where in prints minutiae are found, missed and made up.

    .venv/bin/python benchmarks/minutiae_places.py --synthetic [--against IMAGES MINUTIAE NAME]...

With ``--synthetic`` eight synthetic databases are made, from which nothing was learned, and the
true minutiae are the known ones. With ``--against`` those of the extractor NAME are: IMAGES is an
FVC-style database, MINUTIAE a folder of files FFF_M.csv with the columns x, y, theta, type and
quality. Printed are, for the border, the core, faint, smeared and other places and for all
together, how many minutiae are known, the share of them that is found (recall), and the share of
the extracted ones that is known (precision), within 12 px and 22.5 degrees. Which places are which,
`research.experiments.minutiae_places` says; cores are known of synthetic prints alone.

``--json`` writes what `python -m research tables accuracy --places` reads.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import defaultdict
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import repository  # noqa: F401

from fpmatch.errors import DatasetError, FpmatchError
from fpmatch.evaluation.extraction import extract_datasets
from fpmatch.evaluation.ground_truth.truth import TRUTH_FOLDER, load_truth
from fpmatch.evaluation.run import load_datasets
from fpmatch.formats.files import load_record
from fpmatch.image.io.read import read_image
from fpmatch.output import atomic_write_bytes, check_writable
from research.experiments.minutiae_places import (
    PLACES,
    PlaceCounts,
    count_by_place,
    format_places,
    places_of,
)
from research.synthetic_sets import TEST_SEED, synthetic_sets

if TYPE_CHECKING:
    from fpmatch.evaluation.extraction import ExtractedSet
    from fpmatch.minutiae import Minutiae

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
        sets = extract_datasets(load_datasets(folders), workers=workers)
        return [counted(extracted, true_minutiae(extracted)) for extracted in sets]


def measure(options: argparse.Namespace) -> dict[str, dict[str, dict[str, int]]]:
    """Return the counts of each source of known minutiae."""
    rows = {}
    if options.synthetic:
        total: Counts = defaultdict(PlaceCounts)
        for found in _synthetic(options.prints, options.workers):
            for place, counts in found.items():
                total[place] += counts
        rows["synthetic prints"] = as_json(total)
    for images, minutiae, name in options.against:
        (extracted,) = extract_datasets(load_datasets([Path(images)]), workers=options.workers)
        rows[f"{extracted.dataset.name}, {name}"] = as_json(
            counted(extracted, minutiae_of(Path(minutiae), extracted))
        )
    return rows


def main() -> int:
    """Run the script; return its exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--synthetic", action="store_true", help="make prints, take their truth")
    parser.add_argument("--prints", type=Path, help="keep the synthetic prints in this folder")
    parser.add_argument(
        "--against",
        nargs=3,
        action="append",
        default=[],
        metavar=("IMAGES", "MINUTIAE", "NAME"),
        help="a database, what another extractor found in it, and its name (repeatable)",
    )
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--workers", type=int, help="processes to use (default: one a core)")
    options = parser.parse_args()
    if not options.synthetic and not options.against:
        parser.error("nothing to measure: give --synthetic or --against")
    try:
        if options.json:
            check_writable(options.json)
        rows = measure(options)
        print(format_places(rows))
        if options.json:
            atomic_write_bytes(options.json, f"{json.dumps({'rows': rows}, indent=1)}\n".encode())
    except FpmatchError as error:
        print(f"minutiae_places: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
