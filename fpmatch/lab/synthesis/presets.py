"""Presets: how carefully fingers are placed on the sensor, from clean to hard."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

from fpmatch.lab.synthesis.contact import PressureParameters, SmearParameters
from fpmatch.lab.synthesis.master import (
    AVERAGE_ROWS,
    MasterParameters,
    PeriodParameters,
    SilhouetteParameters,
)
from fpmatch.lab.synthesis.warp import PlacementParameters


@dataclass(frozen=True, slots=True)
class Preset:
    """Name the ranges from which impressions are drawn."""

    name: str
    placement: PlacementParameters = field(default_factory=PlacementParameters)
    pressure: PressureParameters = field(default_factory=PressureParameters)
    smear: SmearParameters = field(default_factory=SmearParameters)
    texture: float = 1.0  # visible share of the skin's roughness and pores
    master: MasterParameters = field(default_factory=MasterParameters)  # where none is given
    detailed: bool = False  # skin with uneven ridges, pores in rows and incipient ridges


# fmt: off
_CLEAN: Final = Preset(
    "clean",
    PlacementParameters(half_width=(122, 134), traction=(0, 1), torsion_deg=(0, 1)),
    PressureParameters(dryness=(-0.1, 0.1), unevenness=0.05, tilt=(0, 0), grain=0.05, wear=(0, 0),
                       creases=0.0, max_scratches=0, max_spots=0),
    SmearParameters(chance=0.0, stain=(0.0, 0.0)),
    texture=0.4,
)
_NORMAL: Final = Preset(
    "normal",
    PlacementParameters(rotation_deg=(0, 20), shift=(0, 55), scale=(0.96, 1.06), torsion_deg=(0, 7),
                        traction=(0, 10), off_centre=(0, 62), half_width=(100, 138),
                        elongation=(1.35, 1.75), tip_only=0.16, cut_off=0.2, strain=(0, 0.1)),
    PressureParameters(dryness=(-0.7, 0.75), unevenness=0.2, unevenness_extent_px=70,
                       tilt=(0, 0.3), grain=0.0, beading=(0.05, 0.35), middle=(0, 0.4),
                       wear=(0, 0.35), max_scratches=3, max_spots=1, edge=(0.03, 0.16),
                       outline=0.035, ragged=0.015),
    SmearParameters(chance=0.2, stain=(0.0, 0.1)),
    detailed=True,
)
_HARD: Final = Preset(
    "hard",
    PlacementParameters(rotation_deg=(0, 30), shift=(0, 75), scale=(0.93, 1.12), torsion_deg=(0, 9),
                        traction=(0, 13), off_centre=(10, 65), half_width=(88, 136),
                        elongation=(1.25, 1.75), tip_only=0.2, cut_off=0.25, strain=(0.02, 0.2)),
    PressureParameters(dryness=(-0.75, 0.8), unevenness=0.24, unevenness_extent_px=70,
                       tilt=(0, 0.4), grain=0.0, beading=(0.1, 0.45), middle=(0, 0.6),
                       wear=(0.05, 0.5), max_scratches=5, max_spots=2, edge=(0.02, 0.2),
                       outline=0.05, ragged=0.02),
    SmearParameters(chance=0.4, share=(0.05, 0.25), stain=(0.0, 0.25)),
    texture=1.2,
    detailed=True,
)
_NAIL_TO_NAIL: Final = MasterParameters(
    shape=(round(1.12 * AVERAGE_ROWS), 672),
    period=PeriodParameters(mean_px=9.6, between_fingers_px=0.6, mean_range_px=(8.4, 11.2)),
    silhouette=SilhouetteParameters(half_width=(0.33, 0.46), tip_height=(0.34, 0.44),
                                    foot_height=(0.32, 0.44), tip_exponent=(2.4, 4.5),
                                    foot_exponent=(4.0, 9.0)),
)
_ROLLED: Final = Preset(
    "rolled",
    PlacementParameters(rotation_deg=(0, 15), shift=(0, 25), scale=(0.98, 1.1), torsion_deg=(0, 6),
                        traction=(0, 14), off_centre=(0, 15), half_width=(336, 380),
                        elongation=(1.0, 1.15), strain=(0.02, 0.16)),
    PressureParameters(dryness=(-0.8, 0.35), unevenness=0.25, unevenness_extent_px=90,
                       tilt=(0, 0.4), grain=0.0, beading=(0.05, 0.3), middle=(-0.4, 0.4),
                       wear=(0, 0.5), max_scratches=4, max_spots=4, edge=(0.02, 0.1),
                       outline=0.03, ragged=0.02),
    SmearParameters(chance=0.5, length_px=(5, 16), share=(0.05, 0.25), stain=(0.0, 0.6)),
    master=_NAIL_TO_NAIL,
    detailed=True,
)
# fmt: on
_STRETCHED: Final = replace(
    _NORMAL,
    name="stretched",
    placement=replace(_NORMAL.placement, torsion_deg=(3, 11), traction=(5, 20)),
)
PRESETS: Final = {
    preset.name: preset for preset in (_CLEAN, Preset("easy"), _NORMAL, _HARD, _STRETCHED, _ROLLED)
}
"""The presets by name: four from the easiest to the hardest, normal prints stretched more, and
prints rolled from nail to nail."""
