"""The synthetic databases that the score is learned from, and calibrated on beside real ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.synthesis.database import make_database

if TYPE_CHECKING:
    from pathlib import Path

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
    fingers: int,
    first_seed: int,
    workers: int | None = None,
    progress: Progress = no_progress,
) -> list[Path]:
    """Make a database of each of `KINDS`, or what is not there of it.

    Parameters
    ----------
    folder : Path
        Where.
    fingers : int
        Fingers of each.
    first_seed : int
        Seed of the first; those of the others follow.
    workers : int, optional
        Processes to use (default: one a core).
    progress : callable
        Told of stage "synth", of each database in turn.

    Returns
    -------
    list of Path
        The databases.
    """
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
