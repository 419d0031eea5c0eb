"""The ground truth of a finger and its impressions, as one JSON file."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.impression import Impression
    from fpmatch.lab.synthesis.master import Master
    from fpmatch.lab.synthesis.sensor import Sensor
    from fpmatch.templates.minutiae import Minutiae

TRUTH_FOLDER: Final = "truth"
NODE_EVERY_PX: Final = 12  # of the displacement field, at 500 dpi
POSITION_DIGITS: Final = 2
FACTOR_DIGITS: Final = 8  # of scale and radians: a millionth of a pixel across a picture


def finger_truth(master: Master, impressions: Mapping[str, dict[str, Any]]) -> bytes:
    """Return the content of a finger's truth file: JSON in one line.

    `impressions` holds the result of `impression_truth` by the stem of each image's name.
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
    text = json.dumps(truth, separators=(",", ":"), allow_nan=False)
    return f"{text}\n".encode("ascii")


def impression_truth(impression: Impression, sensor: Sensor, sha256: str) -> dict[str, Any]:
    """Return the ground truth of one impression, ready for JSON.

    `displacement` belongs to `transform` as it is rounded there: a point p of the image comes from
    ``transform.inverse().apply(p + displacement(p))`` of the master.
    """
    t = impression.transform
    transform = Similarity(
        round(t.scale, FACTOR_DIGITS),
        round(math.remainder(t.rotation, 2 * math.pi), FACTOR_DIGITS),
        round(t.tx, POSITION_DIGITS + 2),
        round(t.ty, POSITION_DIGITS + 2),
    )
    height, width = impression.image.shape
    step = max(1, round(NODE_EVERY_PX * impression.dpi / 500))
    # one node more than needed on each side, so that the image is interpolated from nodes around it
    y, x = (np.arange(-1, (side - 1) // step + 3) * float(step) for side in (height, width))
    nodes = np.stack(np.meshgrid(x, y), axis=-1)
    placed = transform.apply(impression.warp.to_master(nodes.reshape(-1, 2)))
    shift = placed.reshape(nodes.shape) - nodes
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
            "step": step,
            "dx": _rounded(shift[..., 0]),
            "dy": _rounded(shift[..., 1]),
        },
    }


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
    # adding 0 turns -0.0, which JSON distinguishes, into 0.0
    return (values.astype(np.float64).round(POSITION_DIGITS) + 0.0).tolist()  # type: ignore[no-any-return]
