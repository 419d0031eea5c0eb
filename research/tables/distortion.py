"""Tables of scores by the strain between two prints, for the terminal and the page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.errors import DatasetError
from fpmatch.evaluation.report.rate_text import percent

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


def strain_class(row: Mapping[str, Any]) -> str:
    """Name a class of strain in percent.

    Examples
    --------
    >>> strain_class({"from": 0.05, "to": 0.1}), strain_class({"from": 0.4, "to": None})
    ('5 to 10 %', '40 % or more')
    """
    if row["to"] is None:
        return f"{100 * row['from']:.0f} % or more"
    return f"{100 * row['from']:.0f} to {100 * row['to']:.0f} %"


def distortion_rows(
    conditions: Sequence[Mapping[str, Any]], kind: str, names: Sequence[str] = ("",)
) -> list[list[str]]:
    """Return one condition, measured once or several times, as rows of a table below a head.

    `conditions`: one of the ``"conditions"`` of `measure_distortion`, from each measurement.
    `kind`: one of `KINDS`. `names`: what to call each measurement in the head. The result is a row
    a class of strain: largest displacement in the median, genuine pairs, and of each measurement
    the median score, the share below the threshold, and FNMR. Raises a `DatasetError` if the
    measurements are not of the same pairs.
    """
    columns = ("median score", "below threshold", "FNMR")
    head = ["strain", "displacement", "pairs"]
    head += [f"{name} {column}".strip() for column in columns for name in names]
    rows = [head]
    for same in zip(*(condition["classes"] for condition in conditions), strict=False):
        if len({(row["from"], row["pairs"], row["displacement_px"]) for row in same}) != 1:
            raise DatasetError("the measurements of distortion are not of the same pairs")
        cells = [
            strain_class(same[0]),
            f"{same[0]['displacement_px']:.1f} px",
            f"{same[0]['pairs']}",
        ]
        cells += [f"{row[kind]['score']:.1f}" for row in same]
        cells += [percent(row[kind]["below_threshold"]) for row in same]
        cells += [percent(row[kind]["fnmr"]) for row in same]
        rows.append(cells)
    return rows
