"""Make FVC-style databases of synthetic prints, with their ground truth, on disk.

A database is a folder of images ``FFF_M.tif`` (finger FFF, impression M), a file ``dataset.toml``
that describes their parameters, and a folder ``truth`` with one file ``FFF.json`` a finger, which
is written last, with the digests of the images: a finger that has these is complete. What is
damaged or of another database is made again.
"""

from __future__ import annotations

import hashlib
import io
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.folders import remove_unfinished
from fpmatch.base.output import atomic_write_bytes, reason
from fpmatch.base.parsing import ParseError, parse_json
from fpmatch.errors import DatasetError, OutputError
from fpmatch.gallery.engine.folder_lock import folder_lock
from fpmatch.gallery.engine.workers import no_progress, run_chunks
from fpmatch.lab.synthesis.plan import (
    DEFAULT_SENSOR,
    DESCRIPTION_FILE,
    Plan,
    check_same_plan,
    sensors_named,
)
from fpmatch.lab.synthesis.presets import preset_named
from fpmatch.lab.synthesis.truth_file import TRUTH_FOLDER, finger_truth, impression_truth, is_intact

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.lab.synthesis.impression import Impression
    from fpmatch.lab.synthesis.master import MasterParameters
    from fpmatch.lab.synthesis.presets import Preset
    from fpmatch.lab.synthesis.sensor import Sensor


FIRST_FINGER: Final = 101
LAST_FINGER: Final = 9_999_999
COMPRESSION: Final = "tiff_lzw"  # libtiff's own, so its bytes do not vary with a zlib
STAGE: Final = "synth"


@dataclass(frozen=True, slots=True)
class DatabaseMade:
    """The result of `make_database`, and its size."""

    folder: Path
    fingers: int  # requested ones, all complete
    impressions: int  # of each
    made: int  # fingers that this call made
    size: int  # bytes of all their files
    faults: tuple[str, ...] = ()  # of files that were there, and were made again


def finger_numbers(first: int, count: int) -> range:
    """Return the numbers of so many fingers; DatasetError if there are none, or out of range."""
    if not (count >= 1 and first >= 1 and first + count - 1 <= LAST_FINGER):
        raise DatasetError(
            f"{count} fingers from number {first}: "
            f"there must be at least 1, numbered within 1 to {LAST_FINGER}"
        )
    return range(first, first + count)


def make_database(
    out: str | os.PathLike[str],
    *,
    fingers: int,
    impressions: int,
    preset: str | Preset = "normal",
    seed: int = 0,
    sensors: Sequence[str | Sensor] = (DEFAULT_SENSOR,),
    first_finger: int = FIRST_FINGER,
    master: MasterParameters | None = None,
    workers: int | None = None,
    progress: Progress = no_progress,
) -> DatabaseMade:
    """Make a database of synthetic prints, or complete one.

    The same arguments give the same bytes, however often interrupted. More fingers extend a
    database without changing its files. `out`: its folder: a new or empty one, or one that the same
    arguments made. `fingers`, `impressions`: how many fingers, and how many impressions of each.
    `preset`: ``"clean"``, ``"easy"``, ``"normal"``, ``"hard"``, ``"stretched"`` or ``"rolled"``.
    `seed`: family of fingers, from 0. `sensors`: sensors that take the impressions in turn.
    `first_finger`: number of the first finger (default 101), from 1. `master`: parameters of the
    masters (default: as in the preset). `workers`: processes to use (default: one a core).
    `progress`: called with the number of complete fingers of the stage ``"synth"``. Raises a
    `DatasetError` if a count or the seed is impossible, or the folder holds other files or another
    database; an `ImageError` if the preset is unknown; an `OutputError` if a file is not written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch.lab.synthesis.database import make_database
    >>> from fpmatch.lab.synthesis.master import MasterParameters
    >>> from fpmatch.lab.synthesis.plan import plain_sensor
    >>> small = MasterParameters(shape=(96, 96))
    >>> with tempfile.TemporaryDirectory() as out:
    ...     made = make_database(out, fingers=1, impressions=2, seed=7, master=small,
    ...                          sensors=[plain_sensor(64, 64)])
    ...     sorted(path.name for path in Path(out).iterdir())
    ['101_1.tif', '101_2.tif', 'dataset.toml', 'truth']
    """
    numbers = finger_numbers(first_finger, fingers)
    chosen = sensors_named(sensors)
    plan = Plan(seed, preset, chosen, impressions, master or preset_named(preset).master)
    folder = Path(out)
    _make_folder(folder)
    with _alone_in(folder):
        _claim(folder, plan)
        faults = {
            n: fault(_files(folder, n, plan), n, plan)
            for n in numbers
            if all(path.is_file() for path in _files(folder, n, plan))
        }
        missing = [n for n in numbers if faults.get(n, "missing")]
        progress(STAGE, fingers - len(missing), fingers)
        finished = iter(range(fingers - len(missing) + 1, fingers + 1))
        if missing:
            run_chunks(
                partial(_make_finger, folder, {n for n in missing if n in faults}), plan,
                missing, workers=workers,
                finished=lambda _: progress(STAGE, next(finished), fingers),
            )  # fmt: skip
    files = [folder / DESCRIPTION_FILE, *(p for n in numbers for p in _files(folder, n, plan))]
    size = sum(path.stat().st_size for path in files)
    messages = tuple(text for text in faults.values() if text)
    return DatabaseMade(folder, fingers, impressions, len(missing), size, messages)


def _make_finger(folder: Path, faulty: set[int], plan: Plan, number: int) -> None:
    """Write a finger's images, then its truth; those of a `faulty` one are replaced."""
    from fpmatch.lab.synthesis.impression import make_impression  # noqa: PLC0415
    from fpmatch.lab.synthesis.master import make_master  # noqa: PLC0415

    master = make_master(plan.seed, number, plan.master)
    *images, truth = _files(folder, number, plan)
    truths = {}
    for m, path in enumerate(images, start=1):
        sensor = plan.sensor_of(m)
        impression = make_impression(master, m, plan.ranges, sensor)
        content = _tiff(impression)
        _write(path, content, replace=number in faulty)
        digest = hashlib.sha256(content).hexdigest()
        truths[path.stem] = impression_truth(impression, sensor, digest)
    _write(truth, finger_truth(master, truths), replace=number in faulty)


def _files(folder: Path, number: int, plan: Plan) -> list[Path]:
    """Return a finger's files: images in order, and the truth last."""
    images = [folder / f"{number}_{m}.tif" for m in range(1, plan.impressions + 1)]
    return [*images, folder / TRUTH_FOLDER / f"{number}.json"]


def _tiff(impression: Impression) -> bytes:
    from PIL import Image  # noqa: PLC0415

    stream = io.BytesIO()
    dpi = (impression.dpi, impression.dpi)
    Image.fromarray(impression.image).save(stream, "TIFF", compression=COMPRESSION, dpi=dpi)
    return stream.getvalue()


def _write(path: Path, content: bytes, *, replace: bool = False) -> None:
    """Write a new file or one that is damaged, leave an identical one, refuse to replace another.

    With `replace` another one is replaced, too.
    """
    existing = read(path) if path.exists() else None
    if existing == content:
        return
    if existing is not None and not replace and not is_damaged_copy(existing, content):
        raise DatasetError(f"{path}: is in the way: it is not what would be made there")
    atomic_write_bytes(path, content, public=True)


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made: {reason(error)}") from error


def _claim(folder: Path, plan: Plan) -> None:
    """Check that a folder is empty or the database of `plan`; write its description."""
    description, truths = folder / DESCRIPTION_FILE, folder / TRUTH_FOLDER
    try:
        remove_unfinished(folder)
        if description.exists():
            check_same_plan(description, plan)
        elif any(folder.iterdir()):
            raise DatasetError(
                f"{folder}: holds files but no {DESCRIPTION_FILE}: not made by fpmatch synth, "
                "and left as it is"
            )
        else:
            atomic_write_bytes(description, plan.description().encode("ascii"), public=True)
        truths.mkdir(exist_ok=True)
        remove_unfinished(truths)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used: {reason(error)}") from error


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Lock the folder against other processes; the system releases the lock at the end."""
    try:
        with folder_lock(folder, wait=False):
            yield
    except BlockingIOError as error:
        raise DatasetError(f"{folder}: another process is making it") from error


_LEAST_ALIKE: Final = 0.5  # share of its bytes that a damaged copy has in common with the original
_MOST_SHOWN: Final = 40  # characters of a value


def fault(files: list[Path], number: int, plan: Plan) -> str:
    """Return what is wrong with a finger's images and truth, all of which exist; "" for nothing.

    Raises OutputError if a file cannot be read.
    """
    *images, truth = files
    content = read(truth)
    try:
        document = parse_json(content)
        digests = {stem: entry["sha256"] for stem, entry in document["impressions"].items()}
        identity = _identity(document)
    except (ParseError, KeyError, TypeError, AttributeError):
        return f"{truth}: is damaged"
    if not is_intact(content):
        return f"{truth}: is damaged"
    for (name, value), (_, wanted) in zip(identity, _wanted(number, plan), strict=True):
        if value != wanted:
            return f"{truth}: is of {name} {_shown(value)}, not {_shown(wanted)}"
    for path in images:
        if hashlib.sha256(read(path)).hexdigest() != digests[path.stem]:
            return f"{path}: is damaged, or another image"
    return ""


def _identity(document: dict[str, Any]) -> list[tuple[str, object]]:
    """Return what a truth is of."""
    impressions = document["impressions"]
    return [
        ("finger", document["finger"]),
        ("seed", document["seed"]),
        ("impressions", list(impressions)),
        ("presets", [entry["preset"] for entry in impressions.values()]),
        ("sensors", [entry["sensor"] for entry in impressions.values()]),
    ]


def _wanted(number: int, plan: Plan) -> list[tuple[str, object]]:
    """Return what the truth of a finger of a plan is of."""
    each = range(1, plan.impressions + 1)
    return [
        ("finger", number),
        ("seed", plan.seed),
        ("impressions", [f"{number}_{m}" for m in each]),
        ("presets", [plan.ranges.name for _ in each]),
        ("sensors", [plan.sensor_of(m).name for m in each]),
    ]


def _shown(value: object) -> str:
    text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}…"


def is_damaged_copy(copy: bytes, original: bytes) -> bool:
    """Return whether bytes come from a file that was cut short or partly overwritten."""
    if not any(copy):
        return True
    common = min(len(copy), len(original))
    a, b = (np.frombuffer(data, np.uint8, common) for data in (copy, original))
    return bool(np.count_nonzero(a == b) >= _LEAST_ALIKE * len(copy))


def read(path: Path) -> bytes:
    """Return the bytes of a file; raise OutputError if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise OutputError(f"{path}: cannot be read: {reason(error)}") from error
