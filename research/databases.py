"""Databases of prints: given ones, and the synthetic ones that train and test the package."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.gallery.batch.sources import unpack
from fpmatch.gallery.engine.engine import make_engine
from fpmatch.lab.evaluation.databases.extraction import DatasetSource
from fpmatch.lab.evaluation.run import load_datasets
from fpmatch.lab.synthesis.database import make_database
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.lab.evaluation.databases.dataset import Dataset, Impression
    from fpmatch.templates.minutiae import Template

TRAINING_SEED: Final = 601
"""First seed of the databases that the score is trained and calibrated on."""
FINGERS: Final = 30  # of each database
IMPRESSIONS: Final = 8  # of each finger, as in the FVC sets
KINDS: Final = (  # preset and sensor
    ("normal", "optical-388x374"),
    ("normal", "optical-640x480"),
    ("normal", "optical-328x364"),
    ("hard", "optical-328x364"),
    ("hard", "capacitive-300x300"),
    ("hard", "optical-640x480"),
    ("stretched", "optical-640x480"),
    ("stretched", "optical-388x374"),
)


def make_synthetic_sets(
    folder: Path, *, first_seed: int, workers: int | None = None, fingers: int = FINGERS
) -> list[Path]:
    """Make a database of each of `KINDS`, or what is missing of it; return their folders."""
    made = []
    for seed, (preset, sensor) in enumerate(KINDS, first_seed):
        made.append(folder / f"{preset}-{seed}")
        make_database(
            made[-1],
            fingers=fingers,
            impressions=IMPRESSIONS,
            preset=PRESETS[preset],
            seed=seed,
            sensors=(SENSORS[sensor],),
            workers=workers,
        )
    return made


def extract_synthetic_sets(
    first_seed: int, kept_in: Path | None, workers: int | None, fingers: int = FINGERS
) -> list[Dataset]:
    """Make the databases, kept in a folder where it is given; return them with their templates."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = kept_in or Path(temporary)
        made = make_synthetic_sets(folder, first_seed=first_seed, workers=workers, fingers=fingers)
        return extract_folders(made, workers)


def extract_folders(folders: Sequence[Path], workers: int | None = None) -> list[Dataset]:
    """Return FVC-style databases with the templates of their prints."""
    return extract_datasets(load_datasets(folders), workers) if folders else []


def extract_datasets(datasets: Sequence[Dataset], workers: int | None = None) -> list[Dataset]:
    """Return databases with the templates of their prints."""
    extracted = []
    with make_engine(workers) as engine:
        for dataset in datasets:
            made = DatasetSource(dataset).templates(engine, range(len(dataset.impressions)))
            templates = (None if one.data is None else unpack(one.data) for one in made)
            extracted.append(replace(dataset, templates=tuple(templates)))
    return extracted


def prints_of(one: Dataset) -> list[tuple[Impression, Template]]:
    """Return the impressions of a database that have a template, with it."""
    pairs = zip(one.impressions, one.templates, strict=True)
    return [(shown, template) for shown, template in pairs if template is not None]


def without_ridges(template: Template) -> Template:
    """Return a template of minutiae alone."""
    return replace(template, field=None)
