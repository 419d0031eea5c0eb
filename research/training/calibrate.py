"""Calibrations of all matchers, fitted to impostor comparisons of FVC-style databases."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import click
import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.calibrate import calibrate_on, fit_calibration
from fpmatch.lab.evaluation.run import evaluate_matchers
from fpmatch.matching.calibration import CALIBRATION_FOLDER, Calibration
from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher, matcher_names
from research.all_pairs import impostors_among
from research.commands import PATH, Command, read_json, synthetic_folder, workers
from research.databases import (
    TRAINING_SEED,
    extract_folders,
    extract_synthetic_sets,
    without_ridges,
)
from research.training.impostor_pairs import TAIL_FILE
from research.training.tail import with_tail

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.lab.evaluation.rates.scores import Trials

# pairs held against chance lower the highest impostors: fitted to those, scores would rise again
UNHELD: Final = UnitCircleMatcher(beyond_share=0.0)
WITH_RIDGES: Final = 1 / 3
"""Weight of the real prints with their ridges, and the same of the synthetic ones."""
ALONE: Final = 1 / 6
"""Weight of the same prints on minutiae alone."""


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research calibrate fvc/*/* --synthetic --tail
  python -m research calibrate --tail
""",
)
@click.argument("folders", metavar="[DIR...]", nargs=-1, type=PATH)
@click.option("--synthetic", is_flag=True, help="Also use eight synthetic databases.")
@click.option("--tail", is_flag=True, help="Also fit the highest scores of the default matcher.")
@click.option("--matcher", "matchers", multiple=True, help="Only this matcher (repeatable).")
@click.option("--into", type=PATH, default=CALIBRATION_FOLDER, help="Folder to write to.")
@synthetic_folder
@workers
def command(
    folders: tuple[Path, ...],
    synthetic: bool,
    tail: bool,
    matchers: tuple[str, ...],
    into: Path,
    prints: Path | None,
    workers: int | None,
) -> None:
    """Fit the package's calibrations to the FVC-style databases DIR.

    Each matcher's calibration is fitted to all impostor comparisons of the extended protocol. With
    --synthetic eight synthetic databases of thirty fingers are added. The default matcher then
    compares all synthetic prints with one another, and all prints with their ridges as well as on
    minutiae alone; real and synthetic prints have half of the weight each, and two thirds of that
    belong to comparisons with ridges. The same prints give the same files to the last bit.
    With --tail the highest scores of the default matcher are calibrated on the pairs of synthetic
    templates that `train tail` measured; without DIR, the other scores stay as they are.
    """
    high = read_json(TAIL_FILE) if tail else None
    if not folders and not synthetic:
        if high is None:
            raise DatasetError("needs FVC-style databases DIR, --synthetic or --tail")
        file = into / f"{DEFAULT_MATCHER}.json"
        given = Calibration.from_json(file.read_text(encoding="utf-8"), file.name)
        file.write_text(with_tail(given, high).as_json(), encoding="utf-8")
        return
    real = extract_folders(folders, workers)
    made = extract_synthetic_sets(TRAINING_SEED, prints, workers) if synthetic else []
    origin = f"python -m research calibrate DIR...{' --synthetic' if synthetic else ''}"
    into.mkdir(parents=True, exist_ok=True)
    for name in matchers or matcher_names():
        if synthetic and name == DEFAULT_MATCHER:
            impostors = _impostors_by_form(real, made, workers)
            shares = [share / len(real) for share in (WITH_RIDGES, ALONE) for _ in real]
            shares += [WITH_RIDGES, ALONE]
            counts = np.array([one.similarity.size for one in impostors])
            weights = np.repeat(np.array(shares) / np.maximum(counts, 1), counts)
            calibration = fit_calibration(
                np.concatenate([one.similarity for one in impostors]), weights
            )
            known = calibrate_on(impostors, name, origin).provenance  # counts every finger twice
            halved = {**known, "fingers": known["fingers"] // 2}
            calibration = replace(calibration, provenance=halved)
        else:
            (report,) = evaluate_matchers([*real, *made], [name], workers=workers)
            calibration = calibrate_on(report.impostors, get_matcher(name).name, origin)
        if high is not None and name == DEFAULT_MATCHER:
            calibration = with_tail(calibration, high)
        target = into / f"{get_matcher(name).name}.json"
        target.write_text(calibration.as_json(), encoding="utf-8")
        click.echo(f"{target}: {calibration.provenance['impostors']} impostor comparisons")


def _impostors_by_form(
    real: Sequence[Dataset], synthetic: Sequence[Dataset], workers: int | None
) -> list[Trials]:
    """Return the impostor comparisons of each real database, and of all synthetic prints."""
    impostors = []
    for sets in (real, [_without_ridges(one) for one in real]):
        (report,) = evaluate_matchers(sets, [UNHELD], workers=workers)
        impostors += report.impostors
    seeds = f"seeds {TRAINING_SEED} to {TRAINING_SEED + len(synthetic) - 1}"
    for name, sets in (
        ("synthetic", synthetic),
        ("synthetic, minutiae alone", [_without_ridges(one) for one in synthetic]),
    ):
        impostors.append(impostors_among(sets, f"{name}, {seeds}", workers, UNHELD))
    return impostors


def _without_ridges(extracted: Dataset) -> Dataset:
    """Return a database whose templates have no ridge field."""
    name = f"{extracted.name}, minutiae alone"
    templates = (one and without_ridges(one) for one in extracted.templates)
    return replace(extracted, name=name, templates=tuple(templates))
