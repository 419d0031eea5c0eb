"""Targets: functions of the public interface, with arrays of any numbers."""

from __future__ import annotations

import io
import warnings
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np

import fpmatch
from fpmatch.base.npy import decode_npy
from fpmatch.errors import FpmatchError
from fpmatch.lab.points.match import POINT_MATCHERS, match_points
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from research.fuzzing.target import SAMPLES, Reader, Target
from research.fuzzing.targets.stores import PROBE, templates

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_POINTS = 400  # of a set: more are only slower
MOST_PIXELS = 300_000
SIDE = 160  # of the pictures that are damaged


def array_targets() -> list[Target]:
    """Return the targets of arrays: points, templates, pictures."""
    return [
        Target("array-points", _points, kernels=True),
        Target("array-template", _template, kernels=True),
        Target("array-picture", _picture, kernels=True),
    ]


def _points() -> Reader:
    """Match two point sets; the first bytes choose how, the rest are both sets' coordinates."""

    def read(data: bytes) -> None:
        how, numbers = data[:8].ljust(8, b"\0"), np.frombuffer(data[8:][: (len(data) - 8) & ~15])
        points = numbers.reshape(-1, 2)[: 2 * MOST_POINTS]
        half = len(points) * how[4] // 256
        found = match_points(
            points[:half],
            points[half:],
            matcher=POINT_MATCHERS[how[0] % len(POINT_MATCHERS)],
            reflect=bool(how[1] & 1),
        )
        if not np.isfinite(np.array(found.pairs, np.float64)).all():
            raise AssertionError("pairs that are no numbers")

    rng = np.random.default_rng(1)
    corpus = []
    for k, how in enumerate(((0, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0), (2, 0, 0), (1, 1, 0))):
        p = rng.uniform(0, 500, (12 + 4 * k, 2))
        if k % 3 == 2:
            p = np.round(p / 50)  # many that are alike, on lines and circles
        q = p[2:] @ [[0.8, 0.6], [-0.6, 0.8]] + [10, 20]
        share = 256 * len(p) // (len(p) + len(q)) + 1
        corpus.append(bytes([*how, 0, share, 0, 0, 0]) + np.vstack([p, q]).tobytes())
    return Reader(corpus, read)


def _template() -> Reader:
    """Make a template of the arrays of an archive, and compare, draw and convert it."""
    from fpmatch.gallery.store.stored_template import pack_template, unpack_template  # noqa: PLC0415
    from fpmatch.matching.verify import verify  # noqa: PLC0415

    good = templates()[PROBE]

    def read(data: bytes) -> None:
        arrays = _arrays(data)
        template = _as_template(arrays)
        if template.width * template.height > 4_000_000:
            raise FpmatchError("larger than the limits of the target")
        unpack_template(pack_template(template))
        for pair in ((template, good), (good, template)):
            found = verify(*pair)
            if not 0 <= found.score <= 100:
                raise AssertionError(f"score {found.score}")
            found.ridge_map  # noqa: B018  (computed when it is asked for)

    corpus = []
    for template in templates().values():
        m, field = template.minutiae, template.field
        assert field is not None
        assert field.ridges is not None
        stream = io.BytesIO()
        frame = np.array([template.width, template.height, template.dpi, field.step])
        np.savez(
            stream, x=m.x, y=m.y, angle=m.angle, kind=m.kind, quality=m.quality, frame=frame,
            orientation=field.orientation, mask=field.mask, ridges=field.ridges,
        )  # fmt: skip
        corpus.append(stream.getvalue())
    return Reader(corpus, read)


def _arrays(data: bytes) -> dict[str, NDArray[Any]]:
    """Return the arrays of numbers in an archive; FpmatchError where there are no such."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            found = {name: np.asarray(archive[name]) for name in archive.files}
    except (
        *(OSError, ValueError, EOFError, KeyError, SyntaxError, TypeError, OverflowError),
        *(zipfile.BadZipFile, MemoryError, NotImplementedError, RuntimeError, UnicodeError),
    ) as error:
        raise FpmatchError("no archive of arrays") from error
    except Exception as error:  # zlib, tokenize and others
        raise FpmatchError("no archive of arrays") from error
    if any(one.dtype.kind not in "biuf" or one.size > 100_000 for one in found.values()):
        raise FpmatchError("no arrays of numbers, or too many")
    return found


def _as_template(arrays: dict[str, NDArray[Any]]) -> Template:
    """Return the template of some arrays, by the constructors that programs use."""
    frame = arrays.get("frame", np.empty(0)).ravel()
    if frame.size != 4 or not {"x", "y", "angle"} <= set(arrays):
        raise FpmatchError("too few arrays")
    width, height, dpi, step = frame.astype(np.float64).tolist()
    if not abs(width) + abs(height) < 1e9:
        raise FpmatchError("no size")
    columns = {key: arrays[key] for key in ("x", "y", "angle", "kind", "quality") if key in arrays}
    field = None
    if {"orientation", "mask"} <= set(arrays):
        field = RidgeField(step, arrays["orientation"], arrays["mask"], arrays.get("ridges"))
    return Template(Minutiae(**columns), int(width), int(height), dpi, field)


def _picture() -> Reader:
    """Extract the minutiae of an array of any numbers."""

    def read(data: bytes) -> None:
        try:
            with warnings.catch_warnings(action="ignore"):
                decode_npy(data)
                array = np.load(io.BytesIO(data), allow_pickle=False)
        except (ValueError, FpmatchError, OSError, EOFError) as error:
            raise FpmatchError("no array") from error
        if array.size > MOST_PIXELS:
            raise FpmatchError("larger than the limits of the target")
        fpmatch.extract(array, dpi=500)

    from fpmatch.image.io.read import read_image  # noqa: PLC0415

    whole = read_image(SAMPLES / "101_1.tif").pixels
    middle = whole[100 : 100 + SIDE, 100 : 100 + SIDE]
    corpus = []
    for one in (middle, middle[:60], middle[:, :50], middle / 255.0, np.full((64, 64), 255.0)):
        stream = io.BytesIO()
        np.save(stream, np.ascontiguousarray(one))
        corpus.append(stream.getvalue())
    return Reader(corpus, read)
