"""Parameters of a database of synthetic prints, as written to its ``dataset.toml``."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.base.parsing import ParseError, parse_toml
from fpmatch.errors import DatasetError
from fpmatch.lab.synthesis.master import MasterParameters
from fpmatch.lab.synthesis.presets import preset_named
from fpmatch.lab.synthesis.sensor import SENSORS, Sensor
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.lab.synthesis.presets import Preset

DESCRIPTION_FILE: Final = "dataset.toml"
DEFAULT_SENSOR: Final = "optical-388x374"
LARGEST_SEED: Final = 2**63 - 1  # what TOML can hold
MOST_IMPRESSIONS: Final = 1000
_DIGITS_OF_PARAMETERS: Final = 16


@dataclass(frozen=True, slots=True)
class Plan:
    """Fix all parameters of the prints of a database.

    A DatasetError is raised for a number out of its range or no sensor, an ImageError for an
    unknown preset.
    """

    seed: int  # family of fingers, 0 to 2**63 - 1
    preset: str | Preset  # of the impressions, or its name
    sensors: tuple[Sensor, ...]  # impression m is taken by number (m - 1) % len(sensors)
    impressions: int  # of each finger, 1 to 1000
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

    @property
    def ranges(self) -> Preset:
        """The preset of the impressions."""
        return preset_named(self.preset)

    def sensor_of(self, number: int) -> Sensor:
        """Return the sensor that takes impression `number`, from 1."""
        return self.sensors[(number - 1) % len(self.sensors)]

    def table(self) -> dict[str, Any]:
        """Return the table ``[synthesis]`` of the description, equal for equal databases."""
        ranges = repr((self.ranges, self.sensors, self.master)).encode()
        return {
            "seed": self.seed,
            "preset": self.ranges.name,
            "sensors": [sensor.name for sensor in self.sensors],
            "impressions": self.impressions,
            "fpmatch": __version__,
            "parameters": hashlib.sha256(ranges).hexdigest()[:_DIGITS_OF_PARAMETERS],
        }

    def description(self) -> str:
        """Return the text of ``dataset.toml``, which does not depend on the number of fingers."""
        resolutions = {sensor.dpi for sensor in self.sensors}
        top: dict[str, Any] = {"name": f"synthetic, {self.ranges.name}, seed {self.seed}"}
        if len(resolutions) == 1:
            dpi = resolutions.pop()
            top["dpi"] = int(dpi) if dpi.is_integer() else dpi
        top["sensor"] = ", ".join(f"synthetic {sensor.name}" for sensor in self.sensors)
        return f"{_toml(top)}\n[synthesis]\n{_toml(self.table())}"


def plain_sensor(width: int, height: int, dpi: float = STANDARD_DPI) -> Sensor:
    """Return a sensor of any size, with a white ground and no faults, named by its size."""
    return Sensor(f"{width}x{height}@{dpi:g}dpi", width, height, dpi)


def sensors_named(sensors: Sequence[str | Sensor]) -> tuple[Sensor, ...]:
    """Return sensors, those given by name from `SENSORS`; raise DatasetError if one is unknown."""
    for sensor in sensors:
        if isinstance(sensor, str) and sensor not in SENSORS:
            raise DatasetError(f"no sensor {sensor!r}: there are {', '.join(SENSORS)}")
    return tuple(SENSORS[sensor] if isinstance(sensor, str) else sensor for sensor in sensors)


def check_same_plan(path: Path, plan: Plan) -> None:
    """Raise DatasetError if the ``dataset.toml`` at `path` describes another plan."""
    try:
        stated = parse_toml(path.read_bytes()).get("synthesis")
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {error.strerror}") from error
    except ParseError as error:
        raise DatasetError(f"{path}: not a readable TOML file: {error}") from error
    if not isinstance(stated, dict):
        raise DatasetError(f"{path}: describes prints that were not made by fpmatch synth")
    for key, value in plan.table().items():
        if stated.get(key) != value:
            raise DatasetError(
                f"{path}: the prints there were made with {key} {stated.get(key)!r}, not {value!r}"
            )


def _toml(entries: dict[str, Any]) -> str:
    """Return entries whose values TOML writes as JSON does: text, numbers, and lists of them."""
    return "".join(f"{key} = {json.dumps(value)}\n" for key, value in entries.items())
