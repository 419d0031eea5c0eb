"""The whole truth about a finger and its impressions, as one JSON file holds it."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.pointset.similarity import Similarity
from fpmatch.synthesis.displacement import DisplacementField

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.minutiae import Minutiae
    from fpmatch.synthesis.impression import Impression
    from fpmatch.synthesis.master import Master
    from fpmatch.synthesis.sensor import Sensor

TRUTH_FOLDER: Final = "truth"
NODE_EVERY_PX: Final = 12  # of the displacement field, at 500 dpi
POSITION_DIGITS: Final = 2
FACTOR_DIGITS: Final = 8  # of scale and radians: a millionth of a pixel across a picture


def finger_truth(master: Master, impressions: Mapping[str, dict[str, Any]]) -> bytes:
    """Return the content of a finger's truth file.

    Parameters
    ----------
    master : Master
        The finger.
    impressions : dict of dict
        What `impression_truth` says of each impression, by the stem of its image's name.

    Returns
    -------
    bytes
        JSON in one line.

    Examples
    --------
    >>> from fpmatch.synthesis.master import MasterParameters, make_master
    >>> content = finger_truth(make_master(7, 101, MasterParameters(shape=(96, 96))), {})
    >>> json.loads(content)["master_size"]
    [96, 96]
    """
    rows, columns = master.relief.shape
    truth = {
        "finger": master.finger,
        "seed": master.seed,
        "pattern": master.pattern.value,
        "master_size": [columns, rows],
        "minutiae": _columns(master.minutiae),
        "cores": _rounded(master.cores),
        "deltas": _rounded(master.deltas),
        "impressions": dict(impressions),
    }
    return (json.dumps(truth, separators=(",", ":"), allow_nan=False) + "\n").encode("ascii")


def impression_truth(impression: Impression, sensor: Sensor, sha256: str) -> dict[str, Any]:
    """Return what a truth file says of one impression.

    Parameters
    ----------
    impression : Impression
        The impression.
    sensor : Sensor
        What it was taken with.
    sha256 : str
        Digest of its image file.

    Returns
    -------
    dict
        Ready for JSON. `displacement` belongs to `transform` as it stands there, rounded: a
        point p of the picture comes from ``transform.inverse().apply(p + displacement(p))`` of the
        master.
    """
    transform = _rounded_transform(impression.transform)
    height, width = impression.image.shape
    field = displacement_of(impression, transform)
    return {
        "preset": impression.preset,
        "sensor": sensor.name,
        "size": [width, height],
        "dpi": impression.dpi,
        "sha256": sha256,
        "transform": {
            "scale": transform.scale,
            "rotation": transform.rotation,
            "rotation_deg": round(transform.rotation_deg, 4),
            "tx": transform.tx,
            "ty": transform.ty,
        },
        "residual_rms_px": round(impression.residual_rms_px, 3),
        "minutiae": _columns(impression.minutiae)
        | {"master": impression.master.tolist(), "visible": impression.visible.tolist()},
        "displacement": {
            "step": int(field.step),
            "dx": _rounded(field.shift[..., 0]),
            "dy": _rounded(field.shift[..., 1]),
        },
    }


def displacement_of(impression: Impression, transform: Similarity) -> DisplacementField:
    """Return where an impression's skin would lie had `transform` alone moved it.

    Parameters
    ----------
    impression : Impression
        The impression.
    transform : Similarity
        From the master to the picture.

    Returns
    -------
    DisplacementField
        Over the picture, a node every 12 pixels at 500 dpi.
    """
    step = max(1, round(NODE_EVERY_PX * impression.dpi / 500))
    rows, columns = impression.image.shape
    return DisplacementField.sampled(
        lambda points: transform.apply(impression.warp.to_master(points)), (rows, columns), step
    )


def _rounded_transform(transform: Similarity) -> Similarity:
    return Similarity(
        round(transform.scale, FACTOR_DIGITS),
        round(math.remainder(transform.rotation, 2 * math.pi), FACTOR_DIGITS),
        round(transform.tx, POSITION_DIGITS + 2),
        round(transform.ty, POSITION_DIGITS + 2),
    )


def _columns(minutiae: Minutiae) -> dict[str, list[Any]]:
    """Return minutiae as columns: x and y in pixels, direction in degrees, ISO kind."""
    degrees = np.degrees(minutiae.angle.astype(np.float64)).round(POSITION_DIGITS) % 360
    return {
        "x": _rounded(minutiae.x),
        "y": _rounded(minutiae.y),
        "angle_deg": degrees.tolist(),
        "kind": minutiae.kind.tolist(),
    }


def _rounded(values: NDArray[np.floating]) -> list[Any]:
    # adding 0 turns -0.0, which JSON would tell from 0.0, into the latter
    return (values.astype(np.float64).round(POSITION_DIGITS) + 0.0).tolist()  # type: ignore[no-any-return]
