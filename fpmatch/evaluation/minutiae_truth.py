"""The truth about synthetic prints, as a file ``truth.json`` beside them tells it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError, FpmatchError
from fpmatch.minutiae import Minutiae
from fpmatch.pointset.similarity import Similarity

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.evaluation.dataset import Dataset

TRUTH_FILE: Final = "truth.json"


@dataclass(frozen=True, slots=True, eq=False)
class ImpressionTruth:
    """Hold what is true of one impression; positions in pixels of its image.

    Parameters
    ----------
    transform : Similarity
        Maps the finger's master print onto the image, as well as a similarity can.
    minutiae : Minutiae
        The true minutiae listed for the image, N of them.
    master : ndarray of int64, shape (N,)
        Which of the finger's minutiae each one is.
    visible : ndarray of bool, shape (N,)
        Whether it can be seen.
    hidden_xy : ndarray of float64, shape (K, 2)
        Where the finger's other minutiae lie, in the image or beyond it: the listed ones that
        cannot be seen, and those not listed, by `transform`.
    """

    transform: Similarity
    minutiae: Minutiae
    master: NDArray[np.int64]
    visible: NDArray[np.bool_]
    hidden_xy: NDArray[np.float64]

    @property
    def visible_xy(self) -> NDArray[np.float64]:
        """Positions of the minutiae that can be seen, shape (M, 2)."""
        return self.minutiae.xy[self.visible].astype(np.float64)


def load_truth(dataset: Dataset) -> tuple[ImpressionTruth, ...]:
    """Read the file ``truth.json`` that lies beside a database's prints.

    Its object ``fingers`` holds, by finger, the columns ``x`` and ``y`` of all ``minutiae`` of the
    master print; ``impressions`` holds, by the stem of the image's name (``101_1``), ``transform``
    (``scale``, ``rotation`` in radians, ``tx``, ``ty``) and ``minutiae``, column by column:
    ``x``, ``y``, ``angle_deg``, ``kind``, ``master`` (index in the finger's list) and, where not
    all of them can be seen, ``visible``. Whatever else it holds is passed over.

    Parameters
    ----------
    dataset : Dataset
        The database.

    Returns
    -------
    tuple of ImpressionTruth
        One for each impression, in the order of `dataset`.

    Raises
    ------
    DatasetError
        If the file is missing or malformed, or an impression is not in it.
    """
    path = dataset.impressions[0].path.parent / TRUTH_FILE
    document = _read_object(path)
    return tuple(_impression_truth(path, document, i.path.stem) for i in dataset.impressions)


def _read_object(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise DatasetError(f"{path}: no such file; true minutiae are read from it") from error
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        reason = str(error).splitlines()[0]
        raise DatasetError(f"{path}: not a readable JSON file: {reason}") from error
    for key in ("fingers", "impressions"):
        if not (isinstance(document, dict) and isinstance(document.get(key), dict)):
            raise DatasetError(f"{path}: not the truth about prints: it has no object {key!r}")
    return dict(document)


def _impression_truth(path: Path, document: dict[str, Any], name: str) -> ImpressionTruth:
    finger = name.partition("_")[0]
    for group, key in (("impressions", name), ("fingers", finger)):
        if key not in document[group]:
            raise DatasetError(f"{path}: {group} has no {key!r}")
    try:
        return _parse(document["fingers"][finger], document["impressions"][name])
    except KeyError as error:
        raise DatasetError(f"{path}: impression {name} or its finger has no {error}") from error
    except (FpmatchError, TypeError, ValueError, OverflowError) as error:
        reason = str(error).splitlines()[0]
        raise DatasetError(f"{path}: impression {name} is malformed: {reason}") from error


def _parse(finger: dict[str, Any], impression: dict[str, Any]) -> ImpressionTruth:
    of_finger = finger["minutiae"]
    master_xy = np.array([of_finger["x"], of_finger["y"]], dtype=np.float64).T.reshape(-1, 2)
    columns = impression["minutiae"]
    minutiae = Minutiae(
        x=columns["x"],
        y=columns["y"],
        angle=np.radians(np.array(columns["angle_deg"], dtype=np.float64)),
        kind=columns["kind"],
    )
    master = _column("master", columns["master"], int, len(minutiae))
    if len(set(master)) < len(master) or not set(master) <= set(range(len(master_xy))):
        raise ValueError("master must be different indices into the finger's minutiae")
    visible = _column("visible", columns.get("visible", [True] * len(master)), bool, len(minutiae))
    numbers = impression["transform"]
    transform = Similarity(*(float(numbers[key]) for key in ("scale", "rotation", "tx", "ty")))
    unlisted = np.setdiff1d(np.arange(len(master_xy)), master)
    seen = np.array(visible, dtype=bool)
    return ImpressionTruth(
        transform=transform,
        minutiae=minutiae,
        master=np.array(master, dtype=np.int64),
        visible=seen,
        hidden_xy=np.vstack([minutiae.xy[~seen], transform.apply(master_xy[unlisted])]),
    )


def _column(name: str, values: object, kind: type, length: int) -> list[Any]:
    """Return a column of JSON values that are all of one kind, or refuse it."""
    if not isinstance(values, list) or any(type(value) is not kind for value in values):
        raise ValueError(f"{name} must be a list of {kind.__name__}")
    if len(values) != length:
        raise ValueError(f"{name} has {len(values)} values where x has {length}")
    return values
