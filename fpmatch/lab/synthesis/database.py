"""Make FVC-style databases of synthetic prints, with their ground truth, on disk.

A database is a folder of images ``FFF_M.tif`` (finger FFF, impression M), a file ``dataset.toml``
that describes their parameters, and a folder ``truth`` with one file ``FFF.json`` a finger, which
is written last: a finger that has it is complete.
"""

from __future__ import annotations

import hashlib
import io
import json
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.base.folders import remove_unfinished
from fpmatch.base.output import atomic_write_bytes, reason
from fpmatch.errors import DatasetError, OutputError
from fpmatch.gallery.engine.engine import make_engine
from fpmatch.gallery.engine.folder_lock import folder_lock
from fpmatch.gallery.engine.workers import no_progress
from fpmatch.lab.synthesis.impression import TRUTH_FOLDER, finger_truth, impression_truth
from fpmatch.lab.synthesis.master import MasterParameters
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import DEFAULT_SENSOR, SENSORS

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.lab.synthesis.presets import Preset
    from fpmatch.lab.synthesis.sensor import Sensor

FIRST_FINGER: Final = 101
COMPRESSION: Final = "tiff_lzw"  # libtiff's own, so its bytes do not vary with a zlib
STAGE: Final = "synth"
DESCRIPTION_FILE: Final = "dataset.toml"
LARGEST_SEED: Final = 2**63 - 1  # what TOML can hold
MOST_IMPRESSIONS: Final = 1000
_DIGITS_OF_PARAMETERS: Final = 16


@dataclass(frozen=True, slots=True)
class Plan:
    """Fix all parameters of the prints of a database."""

    seed: int  # family of fingers, 0 to 2**63 - 1
    preset: Preset  # of the impressions
    sensors: tuple[Sensor, ...]  # impression m is taken by number (m - 1) % len(sensors)
    impressions: int  # of each finger, 1 to 1000
    master: MasterParameters = field(default_factory=MasterParameters)

    def sensor_of(self, number: int) -> Sensor:
        """Return the sensor that takes impression `number`, from 1."""
        return self.sensors[(number - 1) % len(self.sensors)]

    def table(self) -> dict[str, Any]:
        """Return the table ``[synthesis]`` of the description, equal for equal databases."""
        ranges = repr((self.preset, self.sensors, self.master)).encode()
        return {
            "seed": self.seed,
            "preset": self.preset.name,
            "sensors": [sensor.name for sensor in self.sensors],
            "impressions": self.impressions,
            "fpmatch": __version__,
            "parameters": hashlib.sha256(ranges).hexdigest()[:_DIGITS_OF_PARAMETERS],
        }

    def description(self) -> str:
        """Return the text of ``dataset.toml``, which does not depend on the number of fingers."""
        resolutions = {sensor.dpi for sensor in self.sensors}
        top: dict[str, Any] = {"name": f"synthetic, {self.preset.name}, seed {self.seed}"}
        if len(resolutions) == 1:
            dpi = resolutions.pop()
            top["dpi"] = int(dpi) if dpi.is_integer() else dpi
        top["sensor"] = ", ".join(f"synthetic {sensor.name}" for sensor in self.sensors)
        # TOML writes text, numbers and lists of them as JSON does
        parts = [
            "".join(f"{key} = {json.dumps(value)}\n" for key, value in table.items())
            for table in (top, self.table())
        ]
        return "\n[synthesis]\n".join(parts)


@dataclass(frozen=True, slots=True)
class DatabaseMade:
    """The result of `make_database`."""

    folder: Path
    fingers: int  # requested ones, all complete
    impressions: int  # of each
    made: int  # fingers that this call made


def make_database(
    out: str | os.PathLike[str],
    *,
    fingers: int,
    impressions: int,
    preset: Preset = PRESETS["normal"],
    seed: int = 0,
    sensors: Sequence[Sensor] = (SENSORS[DEFAULT_SENSOR],),
    master: MasterParameters | None = None,
    workers: int | None = None,
    progress: Progress = no_progress,
) -> DatabaseMade:
    """Make a database of synthetic prints, or complete one.

    The same arguments give the same bytes, however often interrupted. More fingers extend a
    database without changing its files. `out`: its folder: a new or empty one, or one that the same
    arguments made. `fingers`, `impressions`: how many fingers, and how many impressions of each.
    `preset`: one of `fpmatch.lab.synthesis.presets.PRESETS`. `seed`: family of fingers, from 0.
    `sensors`: what takes the impressions in turn, of `fpmatch.lab.synthesis.sensor.SENSORS`.
    `master`: parameters of the masters (default: as in the preset). `workers`: processes to use
    (default: one a core). `progress`: called with the number of complete fingers of the stage
    ``"synth"``. Raises a `DatasetError` if a count or the seed is impossible, the folder holds
    other files or another database, or another process is making it; an `OutputError` if a file is
    not written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.lab.synthesis.database import make_database
    >>> with tempfile.TemporaryDirectory() as out:
    ...     made = make_database(out, fingers=1, impressions=2, seed=7, workers=1)
    ...     sorted(path.name for path in Path(out).iterdir())
    ['101_1.tif', '101_2.tif', 'dataset.toml', 'truth']
    """
    if fingers < 1 or not 1 <= impressions <= MOST_IMPRESSIONS or not sensors:
        counts = f"{fingers} fingers, {impressions} impressions, {len(sensors)} sensors"
        raise DatasetError(f"{counts}: at least 1 each, and at most {MOST_IMPRESSIONS} impressions")
    if not 0 <= seed <= LARGEST_SEED:
        raise DatasetError(f"seed {seed}: must lie between 0 and {LARGEST_SEED}")
    numbers = range(FIRST_FINGER, FIRST_FINGER + fingers)
    plan = Plan(seed, preset, tuple(sensors), impressions, master or preset.master)
    content, folder = plan.description().encode("ascii"), Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with folder_lock(folder, wait=False):
            description, truths = folder / DESCRIPTION_FILE, folder / TRUTH_FOLDER
            remove_unfinished(folder)
            if description.exists():
                if description.read_bytes() != content:
                    raise DatasetError(f"{description}: the prints there were made otherwise")
            elif any(folder.iterdir()):
                raise DatasetError(
                    f"{folder}: holds files but no {DESCRIPTION_FILE}: not made by fpmatch synth"
                )
            else:
                atomic_write_bytes(description, content, public=True)
            truths.mkdir(exist_ok=True)
            remove_unfinished(truths)
            files = ((n, _files(folder, n, plan)) for n in numbers)
            missing = [n for n, paths in files if not all(path.is_file() for path in paths)]
            progress(STAGE, fingers - len(missing), fingers)
            engine = make_engine(workers if len(missing) > 1 else 1)
            with closing(engine.map(partial(_make_finger, folder), plan, missing)) as made:
                for done, _ in enumerate(made, fingers - len(missing) + 1):
                    progress(STAGE, done, fingers)
    except BlockingIOError as error:
        raise DatasetError(f"{folder}: another process is making it") from error
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used: {reason(error)}") from error
    return DatabaseMade(folder, fingers, impressions, len(missing))


def _files(folder: Path, number: int, plan: Plan) -> list[Path]:
    """Return a finger's files: images in order, and the truth last."""
    images = [folder / f"{number}_{m}.tif" for m in range(1, plan.impressions + 1)]
    return [*images, folder / TRUTH_FOLDER / f"{number}.json"]


def _make_finger(folder: Path, plan: Plan, number: int) -> None:
    """Write a finger's images, then its truth."""
    from PIL import Image  # noqa: PLC0415

    from fpmatch.lab.synthesis.impression import make_impression  # noqa: PLC0415
    from fpmatch.lab.synthesis.master import make_master  # noqa: PLC0415

    master = make_master(plan.seed, number, plan.master)
    *images, truth = _files(folder, number, plan)
    truths = {}
    for m, path in enumerate(images, start=1):
        sensor = plan.sensor_of(m)
        impression = make_impression(master, m, plan.preset, sensor)
        stream, dpi = io.BytesIO(), (impression.dpi, impression.dpi)
        Image.fromarray(impression.image).save(stream, "TIFF", compression=COMPRESSION, dpi=dpi)
        content = stream.getvalue()
        _write(path, content)
        digest = hashlib.sha256(content).hexdigest()
        truths[path.stem] = impression_truth(impression, sensor, digest)
    _write(truth, finger_truth(master, truths))


def _write(path: Path, content: bytes) -> None:
    """Write a new file, leave an equal one, and refuse to replace another."""
    if not path.exists():
        atomic_write_bytes(path, content, public=True)
    elif path.read_bytes() != content:
        raise DatasetError(f"{path}: is in the way: it is not what would be made there")
