"""What a database of synthetic prints is made of, as its ``dataset.toml`` says it."""

from __future__ import annotations

import hashlib
import json
import tomllib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.errors import DatasetError
from fpmatch.minutiae import STANDARD_DPI
from fpmatch.synthesis.master import MasterParameters
from fpmatch.synthesis.presets import preset_named
from fpmatch.synthesis.sensor import SENSORS, Sensor

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

DESCRIPTION_FILE: Final = "dataset.toml"
DEFAULT_SENSOR: Final = "optical-388x374"
LARGEST_SEED: Final = 2**63 - 1  # what TOML can hold
MOST_IMPRESSIONS: Final = 1000
_DIGITS_OF_PARAMETERS: Final = 16
_LABELS: Final = {
    "fpmatch": "fpmatch version",
    "parameters": "other ranges of the preset, the sensors or the masters: digest",
}


@dataclass(frozen=True, slots=True)
class Plan:
    """Fix all that a print of a database depends on but its finger.

    Parameters
    ----------
    seed : int
        Name of the family of fingers, 0 to 2**63 - 1.
    preset : str
        Name of the preset that impressions are drawn from.
    sensors : tuple of Sensor
        Impression m is taken by the one with index ``(m - 1) % len(sensors)``.
    impressions : int
        Of each finger, 1 to 1000.
    master : MasterParameters
        How masters are made.

    Raises
    ------
    DatasetError
        If a number is out of its range, or there is no sensor.
    ImageError
        If there is no such preset.

    Examples
    --------
    >>> plan = Plan(7, "normal", (SENSORS["optical-388x374"],), 4)
    >>> print(plan.description().splitlines()[0])
    name = "synthetic, normal, seed 7"
    """

    seed: int
    preset: str
    sensors: tuple[Sensor, ...]
    impressions: int
    master: MasterParameters = field(default_factory=MasterParameters)

    def __post_init__(self) -> None:
        preset_named(self.preset)
        if not 0 <= self.seed <= LARGEST_SEED:
            raise DatasetError(f"seed {self.seed}: must lie between 0 and {LARGEST_SEED}")
        if not 1 <= self.impressions <= MOST_IMPRESSIONS:
            raise DatasetError(
                f"{self.impressions} impressions of a finger: there may be 1 to {MOST_IMPRESSIONS}"
            )
        if not self.sensors:
            raise DatasetError("no sensor: at least one must take the impressions")

    def sensor_of(self, number: int) -> Sensor:
        """Return the sensor that takes impression `number`, from 1."""
        return self.sensors[(number - 1) % len(self.sensors)]

    def table(self) -> dict[str, Any]:
        """Return the table ``[synthesis]`` of the description: databases agree if these do."""
        ranges = repr((preset_named(self.preset), self.sensors, self.master)).encode()
        return {
            "seed": self.seed,
            "preset": self.preset,
            "sensors": [sensor.name for sensor in self.sensors],
            "impressions": self.impressions,
            "fpmatch": __version__,
            "parameters": hashlib.sha256(ranges).hexdigest()[:_DIGITS_OF_PARAMETERS],
        }

    def description(self) -> str:
        """Return the text of ``dataset.toml``; it does not tell how many fingers there are."""
        resolutions = {sensor.dpi for sensor in self.sensors}
        top: dict[str, Any] = {"name": f"synthetic, {self.preset}, seed {self.seed}"}
        if len(resolutions) == 1:
            dpi = resolutions.pop()
            top["dpi"] = int(dpi) if dpi.is_integer() else dpi
        top["sensor"] = ", ".join(f"synthetic {sensor.name}" for sensor in self.sensors)
        return f"{_toml(top)}\n[synthesis]\n{_toml(self.table())}"


def plain_sensor(width: int, height: int, dpi: float = STANDARD_DPI) -> Sensor:
    """Return a sensor of any size, with a white ground and no faults of its own.

    Parameters
    ----------
    width, height : int
        Of the picture, 32 to 4096 pixels.
    dpi : float
        Resolution, 100 to 4000.

    Returns
    -------
    Sensor
        Named by its size and resolution.

    Raises
    ------
    ImageError
        If a side is out of its range.
    ResolutionError
        If the resolution is.

    Examples
    --------
    >>> plain_sensor(500, 600, 1000).name
    '500x600@1000dpi'
    """
    return Sensor(f"{width}x{height}@{dpi:g}dpi", width, height, dpi)


def sensors_named(sensors: Sequence[str | Sensor]) -> tuple[Sensor, ...]:
    """Return sensors, those given by name among `SENSORS`.

    Parameters
    ----------
    sensors : sequence of str or Sensor
        Names, or sensors as they are.

    Returns
    -------
    tuple of Sensor
        The sensors, in order.

    Raises
    ------
    DatasetError
        If there is none of a name.

    Examples
    --------
    >>> sensors_named(["plain-288x384"])[0].shape
    (384, 288)
    """
    for sensor in sensors:
        if isinstance(sensor, str) and sensor not in SENSORS:
            raise DatasetError(f"no sensor {sensor!r}: there are {', '.join(SENSORS)}")
    return tuple(SENSORS[sensor] if isinstance(sensor, str) else sensor for sensor in sensors)


def check_same_plan(path: Path, plan: Plan) -> None:
    """Refuse the description of a database that was not made by this plan.

    Parameters
    ----------
    path : Path
        Its ``dataset.toml``.
    plan : Plan
        What is to be made.

    Raises
    ------
    DatasetError
        If the file cannot be read, or says something else; the message tells what.
    """
    try:
        found = tomllib.loads(path.read_text(encoding="utf-8")).get("synthesis")
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = str(error).splitlines()[0]
        raise DatasetError(f"{path}: not a readable TOML file: {reason}") from error
    if not isinstance(found, dict):
        raise DatasetError(f"{path}: describes prints that were not made by fpmatch synth")
    for key, value in plan.table().items():
        if found.get(key) != value:
            raise DatasetError(
                f"{path}: the prints there were made with {_LABELS.get(key, key)} "
                f"{_in_words(found.get(key))}, not {_in_words(value)}"
            )


def _toml(entries: dict[str, Any]) -> str:
    """Return entries whose values TOML writes as JSON does: text, numbers, and lists of them."""
    return "".join(f"{key} = {json.dumps(value)}\n" for key, value in entries.items())


def _in_words(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)
