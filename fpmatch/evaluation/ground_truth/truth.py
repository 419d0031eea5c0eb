"""The ground truth of synthetic prints, from the files in the folder ``truth`` beside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError, FpmatchError
from fpmatch.minutiae import Minutiae
from fpmatch.output import reason
from fpmatch.parsing import ParseError, parse_json
from fpmatch.pointset.similarity import Similarity
from fpmatch.synthesis.displacement import DisplacementField

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.evaluation.databases.dataset import Dataset

TRUTH_FOLDER: Final = "truth"


@dataclass(frozen=True, slots=True, eq=False)
class ImpressionTruth:
    """The ground truth of one impression; positions in pixels of its image.

    `transform` maps the finger's master print onto the image, up to the `displacement` of the skin.
    For each minutia listed for the image, `master` holds its index in the finger's minutiae. The
    positions `hidden_xy`, in the image or beyond it, are those of the finger's other minutiae:
    listed but not visible, and not listed.
    """

    transform: Similarity
    minutiae: Minutiae
    master: NDArray[np.int64]
    visible: NDArray[np.bool_]
    hidden_xy: NDArray[np.float64]
    displacement: DisplacementField | None = None

    @property
    def visible_xy(self) -> NDArray[np.float64]:
        """Positions of the visible minutiae, shape (M, 2)."""
        return self.minutiae.xy[self.visible].astype(np.float64)

    def to_master(self, points: ArrayLike) -> NDArray[np.float64]:
        """Map image `points` (N, 2) to the master print."""
        relaxed = points if self.displacement is None else self.displacement.relaxed(points)
        return self.transform.inverse().apply(relaxed)

    def from_master(self, points: ArrayLike) -> NDArray[np.float64]:
        """Map `points` (N, 2) of the master print to the image."""
        return _placed(self.transform, self.displacement, points)


def load_truth(dataset: Dataset) -> tuple[ImpressionTruth, ...]:
    """Read the files ``truth/FFF.json`` that lie beside a database's prints, one a finger.

    Of its object, ``minutiae`` holds the columns ``x`` and ``y`` of all minutiae of the master
    print, and ``impressions``, by the stem of the image's name (``101_1``): ``transform``
    (``scale``, ``rotation`` in radians, ``tx``, ``ty``); ``minutiae``, column by column ``x``,
    ``y``, ``angle_deg``, ``kind``, ``master`` (index in the finger's list) and, where not all of
    them can be seen, ``visible``; and, where skin stretched, ``displacement``: ``step``, and the
    rows ``dx`` and ``dy`` of the nodes of a `fpmatch.synthesis.displacement.DisplacementField`,
    such that the point p of the image comes from ``transform.inverse().apply(p + (dx, dy))``.
    Other keys are ignored. Raises a `DatasetError` if a file is missing or malformed, or an
    impression is not in it.
    """
    folder = dataset.impressions[0].path.parent / TRUTH_FOLDER
    stems = [impression.path.stem for impression in dataset.impressions]
    files = {finger: folder / f"{finger}.json" for finger in sorted(map(_finger_of, stems))}
    documents = {finger: _read_object(path) for finger, path in files.items()}
    return tuple(
        _impression_truth(files[finger], documents[finger], stem)
        for stem, finger in zip(stems, map(_finger_of, stems), strict=True)
    )


def _finger_of(stem: str) -> str:
    return stem.partition("_")[0]


def _read_object(path: Path) -> dict[str, Any]:
    try:
        document = parse_json(path.read_bytes())
    except (FileNotFoundError, NotADirectoryError) as error:
        raise DatasetError(f"{path}: no such file; true minutiae are read from it") from error
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {reason(error)}") from error
    except ParseError as error:
        raise DatasetError(f"{path}: not a readable JSON file: {error}") from error
    for key in ("minutiae", "impressions"):
        if not (isinstance(document, dict) and isinstance(document.get(key), dict)):
            raise DatasetError(f"{path}: not the truth about a finger: it has no object {key!r}")
    return dict(document)


def _impression_truth(path: Path, document: dict[str, Any], name: str) -> ImpressionTruth:
    if name not in document["impressions"]:
        raise DatasetError(f"{path}: impressions has no {name!r}")
    try:
        return _parse(document["minutiae"], document["impressions"][name])
    except KeyError as error:
        raise DatasetError(f"{path}: impression {name} or its finger has no {error}") from error
    except (FpmatchError, TypeError, ValueError, OverflowError) as error:
        raise DatasetError(
            f"{path}: impression {name} is malformed: {_first_line(error)}"
        ) from error


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0]


def _parse(of_finger: dict[str, Any], impression: dict[str, Any]) -> ImpressionTruth:
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
    displacement = None
    if "displacement" in impression:
        grid = impression["displacement"]
        shift = np.stack([np.array(grid[key], dtype=np.float64) for key in ("dx", "dy")], axis=-1)
        displacement = DisplacementField(float(grid["step"]), shift)
    unlisted = master_xy[np.setdiff1d(np.arange(len(master_xy)), master)]
    seen = np.array(visible, dtype=bool)
    with np.errstate(over="ignore", invalid="ignore"):
        hidden_xy = np.vstack([minutiae.xy[~seen], _placed(transform, displacement, unlisted)])
    if not np.isfinite(hidden_xy).all():
        raise ValueError("the transform maps minutiae beyond all numbers")
    return ImpressionTruth(
        transform=transform,
        minutiae=minutiae,
        master=np.array(master, dtype=np.int64),
        visible=seen,
        hidden_xy=hidden_xy,
        displacement=displacement,
    )


def _placed(
    transform: Similarity, displacement: DisplacementField | None, points: ArrayLike
) -> NDArray[np.float64]:
    placed = transform.apply(points)
    return placed if displacement is None else displacement.stretched(placed)


def _column(name: str, values: object, kind: type, length: int) -> list[Any]:
    """Return a column of JSON values that are all of one kind, or refuse it."""
    if not isinstance(values, list) or any(type(value) is not kind for value in values):
        raise ValueError(f"{name} must be a list of {kind.__name__}")
    if len(values) != length:
        raise ValueError(f"{name} has {len(values)} values where x has {length}")
    return values
