#!/usr/bin/env python3
"""Measure what elastic distortion of the skin costs the default matcher.

.venv/bin/python research/benchmarks/distortion.py [--json FILE] [--workers N]
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import click
import repository  # noqa: F401

from fpmatch.printable import text_table
from research.commands import Command, json_file, workers, write_json
from research.experiments.distortion import KINDS, DistortionParameters, measure_distortion
from research.tables.accuracy import FORMS, distortion_rows

if TYPE_CHECKING:
    from pathlib import Path

USUAL = DistortionParameters()


@click.command(cls=Command)
@click.option("--fingers", default=USUAL.fingers, show_default=True)
@click.option("--seed", default=USUAL.seed, show_default=True)
@json_file
@workers
def main(fingers: int, seed: int, json_file: Path | None, workers: int | None) -> None:
    """Measure what elastic distortion of the skin costs the default matcher.

    Synthetic fingers are pressed with care, then dragged and turned over the sensor by increasing
    amounts, so that two impressions of a finger differ in the distortion alone, which is known
    exactly. Genuine pairs are put in classes by their strain: the 95th percentile, over the skin in
    both prints, of the share by which a length is longer or shorter than under the nearest
    similarity transform. For each class are printed the median of the largest displacement from
    that transform, the number of pairs, and for templates with ridges and on minutiae alone the
    median score, the share of scores below the default threshold of 40, and FNMR at an FMR of 0.1 %
    of the impostor pairs of the same prints; for whole prints, and for partial ones with fewer
    minutiae. The same seed gives the same results; one core takes about two minutes.

    --json writes what ``python -m research tables accuracy --distortion`` reads.
    """
    result = measure_distortion(DistortionParameters(fingers=fingers, seed=seed), workers=workers)
    for condition in result["conditions"]:
        click.echo(
            f"{condition['name']}, {condition['minutiae']:g} minutiae in the median: "
            f"{condition['genuine']} genuine and {condition['impostor']} impostor pairs"
        )
        for kind, form in zip(KINDS, FORMS, strict=True):
            click.echo(f"\n{form}\n{text_table(distortion_rows([condition], kind))}")
        click.echo()
    if json_file:
        write_json(json_file, result)


if __name__ == "__main__":
    main()
