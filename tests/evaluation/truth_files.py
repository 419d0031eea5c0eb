"""Make the truth about prints that never were, as a file tells it and as it is read."""

import json

import numpy as np

from fpmatch.evaluation.ground_truth.truth import ImpressionTruth
from fpmatch.pointset.geometry.similarity import Similarity

IDENTITY = {"scale": 1.0, "rotation": 0.0, "tx": 0.0, "ty": 0.0}


def truth_document(*names, **changes):
    """Return the truth about a finger that has three minutiae, two in each impression."""
    columns = {
        **{"x": [10.0, 50.0], "y": [20.0, 60.0], "angle_deg": [0.0, 90.0]},
        **{"kind": [1, 2], "master": [0, 2]},
        **changes,
    }
    return {
        "minutiae": {"x": [10, 30, 50], "y": [20, 40, 60]},
        "impressions": {name: {"transform": dict(IDENTITY), "minutiae": columns} for name in names},
    }


def write_truth(folder, document, finger=101):
    """Write the truth about a finger."""
    path = folder / "truth" / f"{finger}.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(document).replace("Infinity", "1e999"))
    return path


def truth_of(minutiae, visible=None, transform=None, hidden=None):
    """Return a truth whose minutiae are the finger's own, in order."""
    seen = np.ones(len(minutiae), bool) if visible is None else np.array(visible, bool)
    unlisted = np.array(hidden or [], dtype=np.float64).reshape(-1, 2)
    return ImpressionTruth(
        transform=transform or Similarity(),
        minutiae=minutiae,
        master=np.arange(len(minutiae)),
        visible=seen,
        hidden_xy=np.vstack([minutiae.xy[~seen], unlisted]),
    )
