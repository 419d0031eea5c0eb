"""The command ``sample-data``: the prints and points of ``sample_data``."""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.lab.synthesis.contact import PressureParameters, SmearParameters
from fpmatch.lab.synthesis.database import DESCRIPTION_FILE, make_database
from fpmatch.lab.synthesis.impression import TRUTH_FOLDER
from fpmatch.lab.synthesis.presets import PRESETS, Preset
from fpmatch.lab.synthesis.sensor import SENSORS as ALL_SENSORS
from fpmatch.lab.synthesis.sensor import Sensor
from fpmatch.lab.synthesis.warp import PlacementParameters
from research.commands import PATH, ROOT, Command
from research.points.random_sets import random_pair

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

FINGERS, IMPRESSIONS = 4, 4
# fmt: off
PRESET: Final = Preset(  # normal prints as they were when these were made, of skin without details
    "normal",
    PlacementParameters(rotation_deg=(0, 20), shift=(0, 55), scale=(0.98, 1.02), torsion_deg=(0, 7),
                        traction=(0, 10), off_centre=(0, 62), half_width=(100, 138),
                        elongation=(1.35, 1.75), tip_only=0.16, cut_off=0.2),
    PressureParameters(dryness=(-0.4, 0.6), unevenness=0.22, tilt=(0, 0.3), grain=0.27,
                       wear=(0, 0.35), max_scratches=3, max_spots=4, outline=0.035, ragged=0.03),
    SmearParameters(chance=0.2, stain=(0.0, 0.22)),
)
# fmt: on
SENSORS: Final = [ALL_SENSORS[name] for name in ("optical-388x374", "optical-328x364")]
PRINT_SEED: Final = 10
HARD: Final[dict[str, Any]] = {
    **{"fingers": 8, "impressions": 3, "preset": PRESETS["hard"], "seed": 1},
    "sensors": (Sensor("132x168@333dpi", 132, 168, 333.0),),
}
STARS, CATALOGUE = 40, 120
RHO, ETA, LAMBDA = 0.8, 0.2, 0.6
POINT_SEED: Final = 7
SIZE: Final = 100.0  # in units of a hundredth of the sets' mean spacing


@click.command(cls=Command)
@click.argument("folder", metavar="[FOLDER]", type=PATH, default=ROOT / "sample_data")
@click.option("--only", type=click.Choice(["prints", "points"]), help="Make nothing else.")
def command(folder: Path, only: str | None) -> None:
    """Make the prints and the points of sample_data again.

    The prints are four fingers, four impressions of each, on two sensors; those in the folder hard
    are of eight others, small and of bad quality, without truth. Prints, truth and dataset.toml of
    FOLDER are replaced; its other files stay. stars.csv holds 40 points; 32 of them
    are in catalogue.csv, slightly displaced, among 88 others. points_truth.json holds the transform
    from the first to the second, and the true pairs as rows from 0.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if only != "points":
        prints = {"fingers": FINGERS, "impressions": IMPRESSIONS, "seed": PRINT_SEED}
        replace_prints(folder, **prints, preset=PRESET, sensors=SENSORS)
        replace_prints(folder / "hard", **HARD)
        shutil.rmtree(folder / "hard" / TRUTH_FOLDER)
    if only != "prints":
        make_sample_points(folder)


def replace_prints(folder: Path, **plan: Any) -> None:
    """Replace the prints of a folder, and their truth, by those that `make_database` makes."""
    with tempfile.TemporaryDirectory() as temporary:
        made = Path(temporary, "made")
        make_database(made, **plan)
        for path in [*folder.glob("[0-9]*_[0-9]*.tif"), folder / DESCRIPTION_FILE]:
            path.unlink(missing_ok=True)
        shutil.rmtree(folder / TRUTH_FOLDER, ignore_errors=True)
        shutil.copytree(made, folder, dirs_exist_ok=True)


def make_sample_points(folder: Path) -> None:
    """Write two sets of points and the truth between them."""
    made = random_pair(STARS, CATALOGUE, RHO, ETA, LAMBDA, rng=POINT_SEED)
    assert made.transform is not None
    moved = made.transform
    truth = {name: getattr(moved, name) for name in ("scale", "rotation", "tx", "ty")}
    truth["tx"], truth["ty"] = truth["tx"] * SIZE, truth["ty"] * SIZE
    record = {
        "transform": {name: round(value, 6) for name, value in truth.items()},
        "jitter": round(made.jitter * SIZE, 6),
        "pairs": made.pairs.tolist(),
    }
    (folder / "stars.csv").write_text(_as_csv(made.p), encoding="utf-8")
    (folder / "catalogue.csv").write_text(_as_csv(made.q), encoding="utf-8")
    (folder / "points_truth.json").write_text(json.dumps(record) + "\n", encoding="utf-8")


def _as_csv(points: NDArray[np.float64]) -> str:
    return "".join(["x,y\n", *(f"{x:.2f},{y:.2f}\n" for x, y in points * SIZE)])
