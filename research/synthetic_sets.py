"""The synthetic databases on which the package is trained, calibrated and tested."""

from __future__ import annotations

import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.lab.evaluation.databases.extraction import extract_datasets
from fpmatch.lab.evaluation.run import load_datasets
from fpmatch.lab.synthesis.database import make_database

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet

TRAINING_SEED: Final = 601
"""First seed of the databases that the score is trained and calibrated on."""
TEST_SEED: Final = 641
"""First seed of databases that nothing was trained on."""
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
    folder: Path,
    *,
    first_seed: int,
    fingers: int = FINGERS,
    workers: int | None = None,
    progress: Progress = no_progress,
) -> list[Path]:
    """Make a database of each of `KINDS`, or what is missing of it; return their folders."""
    made = []
    for seed, (preset, sensor) in enumerate(KINDS, first_seed):
        made.append(folder / f"{preset}-{seed}")
        make_database(
            made[-1],
            fingers=fingers,
            impressions=IMPRESSIONS,
            preset=preset,
            seed=seed,
            sensors=(sensor,),
            workers=workers,
            progress=progress,
        )
    return made


@contextmanager
def synthetic_sets(
    first_seed: int, kept_in: Path | None, workers: int | None
) -> Iterator[list[Path]]:
    """Make the databases in a folder, or in a temporary one where it is None."""
    with tempfile.TemporaryDirectory() as temporary:
        yield make_synthetic_sets(
            kept_in or Path(temporary), first_seed=first_seed, workers=workers
        )


def extract_synthetic_sets(
    first_seed: int, kept_in: Path | None, workers: int | None
) -> list[ExtractedSet]:
    """Return the databases with the templates of their prints."""
    with synthetic_sets(first_seed, kept_in, workers) as folders:
        return extract_datasets(load_datasets(folders), workers=workers)
