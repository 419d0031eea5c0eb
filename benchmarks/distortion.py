#!/usr/bin/env python3
"""Measure what elastic distortion of the skin costs the default matcher.

    .venv/bin/python benchmarks/distortion.py [--json FILE] [--workers N]

Synthetic fingers are pressed with care, and dragged and turned over the sensor farther and farther,
so that only the distortion differs between two impressions of a finger, and is known exactly.
Genuine pairs are put in classes by their strain: the 95th percentile, over the skin that both show,
of the share by which a length is longer or shorter than under the nearest similarity transform.
For each class are printed the median of the largest displacement from that transform, the number of
pairs, and for templates with ridges and on minutiae alone the median score, the share of scores
below the default threshold of 40, and FNMR at an FMR of 0.1 % of the impostor pairs of the same
prints; for whole prints, and for partial ones, which have fewer minutiae. The same seed gives the
same figures; one core takes about two minutes.

``--json`` writes what `python -m research tables accuracy --distortion` reads.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import repository  # noqa: F401

from fpmatch.errors import FpmatchError
from fpmatch.output import atomic_write_bytes, check_writable
from fpmatch.text_table import text_table
from research.experiments.distortion import KINDS, DistortionParameters, measure_distortion
from research.tables.distortion import distortion_rows


def main() -> int:
    """Run the script; return its exit status."""
    usual = DistortionParameters()
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--fingers", type=int, default=usual.fingers, help="(default: %(default)s)")
    parser.add_argument("--seed", type=int, default=usual.seed, help="(default: %(default)s)")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--workers", type=int, help="processes to use (default: one a core)")
    options = parser.parse_args()
    try:
        if options.json:
            check_writable(options.json)
        parameters = DistortionParameters(fingers=options.fingers, seed=options.seed)
        result = measure_distortion(parameters, workers=options.workers)
        for condition in result["conditions"]:
            print(
                f"{condition['name']}, {condition['minutiae']:g} minutiae in the median: "
                f"{condition['genuine']} genuine and {condition['impostor']} impostor pairs"
            )
            for kind, title in zip(KINDS, ("with ridges", "minutiae alone"), strict=True):
                print(f"\n{title}\n{text_table(distortion_rows([condition], kind))}")
            print()
        if options.json:
            atomic_write_bytes(options.json, f"{json.dumps(result, indent=1)}\n".encode())
    except FpmatchError as error:
        print(f"distortion: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
