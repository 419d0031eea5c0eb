"""fpmatch's own JSON format, complete and exact.

A file looks like this::

    {"format": "fpmatch-template", "version": 2, "width": 388, "height": 374, "dpi": 500.0,
     "minutiae": {"x": [...], "y": [...], "angle": [...], "kind": [...], "quality": [...]},
     "ridge_field": {"step": 8.0, "rows": 47, "columns": 49, "orientation": "...", "mask": "...",
                     "ridges": "..."}}

Values follow the conventions of `fpmatch.templates.minutiae` (pixels, radians, ISO kinds).
``ridge_field`` is null where it is unknown. Its ``mask`` is base64 of one bit a cell in row order,
the highest bit of a byte first. Its ``orientation`` is base64 of a little-endian float32 for each
cell inside the mask, in row order: radians in [0, π). Its ``ridges`` is base64 of eight bytes for
each cell inside the mask, one for each row of the cell's binary ridge image, the lowest bit of a
byte leftmost; it is missing if the ridges are unknown. ``"dpi_known": false`` follows the
resolution of a print where nothing states it.
"""

from __future__ import annotations

import base64
import binascii
import json
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.parsing import ParseError, parse_json
from fpmatch.errors import TemplateError
from fpmatch.formats.record import (
    Codec,
    Encoded,
    ReadingOptions,
    TemplateRecord,
    View,
    check_minutiae,
    dropped_notes,
)
from fpmatch.templates.bounds import check_cells
from fpmatch.templates.minutiae import COLUMNS, LARGEST, Minutiae, RidgeField, Template

if TYPE_CHECKING:
    from numpy.typing import NDArray

FORMAT: Final = "fpmatch-template"
VERSION: Final = 2


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold."""
    view = record.single()
    template = view.template
    document = {
        "format": FORMAT,
        "version": VERSION,
        "width": template.width,
        "height": template.height,
        "dpi": template.dpi,
        **({} if template.dpi_known else {"dpi_known": False}),
        "minutiae": {name: _numbers(getattr(template.minutiae, name)) for name in COLUMNS},
        "ridge_field": None if template.field is None else _encode_field(template.field),
    }
    members = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in document.items()]
    return Encoded(("{\n " + ",\n ".join(members) + "\n}\n").encode(), tuple(dropped_notes(record)))


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the template in a file, or raise TemplateError."""
    document = _parse(data)
    if document.get("format") != FORMAT:
        raise TemplateError(f'not a template: expected the member "format": "{FORMAT}"')
    if document.get("version") != VERSION:
        raise TemplateError(f"unknown version of the format (known: {VERSION})")
    columns = _member(document, "minutiae", dict)
    minutiae = Minutiae(*(_column(columns, name) for name in COLUMNS))
    width, height = _member(document, "width", int), _member(document, "height", int)
    field = None
    if document.get("ridge_field") is not None:
        field = _decode_field(_member(document, "ridge_field", dict))
    known = _member({"dpi_known": True} | document, "dpi_known", bool)
    template = Template(minutiae, width, height, _number(document, "dpi"), field, dpi_known=known)
    return TemplateRecord(CODEC.name, (View(template),))


def _recognises(data: bytes) -> bool:
    return data.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{")


def _parse(data: bytes) -> dict[str, Any]:
    """Return the JSON object in `data`."""
    try:
        document = parse_json(data)
    except ParseError as error:
        raise TemplateError(f"not JSON: {error}") from error
    if not isinstance(document, dict):
        raise TemplateError("not a template: expected one JSON object")
    return document


def _member(parent: dict[str, Any], name: str, kind: type) -> Any:
    """Return the member `name` of `parent`, of type `kind` exactly (a bool is not an int)."""
    if type(parent.get(name)) is not kind:
        raise TemplateError(f'"{name}" must be there and of type {kind.__name__}')
    return parent[name]


def _number(parent: dict[str, Any], name: str) -> float:
    """Return the finite number `name` of `parent`."""
    value: Any = parent.get(name)
    if type(value) not in (int, float) or not abs(value) <= LARGEST:
        raise TemplateError(f'"{name}" must be a finite number')
    return float(value)


def _column(columns: dict[str, Any], name: str) -> NDArray[Any]:
    """Return one column of numbers."""
    values = _member(columns, name, list)
    check_minutiae(len(values))
    if not all(type(value) in (int, float) and abs(value) <= LARGEST for value in values):
        raise TemplateError(f"minutiae: {name} must be a list of finite numbers")
    return np.array(values, dtype=np.float64)


def _numbers(column: NDArray[Any]) -> list[Any]:
    """Return a column as Python numbers, the shortest that restore the same float32."""
    return [float(str(value)) for value in column] if column.dtype.kind == "f" else column.tolist()


def _encode_field(field: RidgeField) -> dict[str, Any]:
    orientation = field.orientation[field.mask]
    beyond = (orientation < 0.0) | (orientation >= np.float32(np.pi))
    orientation = np.where(beyond, np.mod(orientation, np.pi), orientation)
    stored = {
        "step": field.step,
        "rows": field.mask.shape[0],
        "columns": field.mask.shape[1],
        "orientation": _to_base64(orientation.astype("<f4")),
        "mask": _to_base64(np.packbits(field.mask)),
    }
    if field.ridges is not None:
        stored["ridges"] = _to_base64(field.ridges[field.mask].astype("<u8"))
    return stored


def _decode_field(stored: dict[str, Any]) -> RidgeField:
    rows, columns = _member(stored, "rows", int), _member(stored, "columns", int)
    check_cells(rows, columns)
    cells = rows * columns
    bits = np.unpackbits(_from_base64(stored, "mask", -(-cells // 8)), count=cells)
    mask = bits.astype(bool).reshape(rows, columns)
    inside = int(np.count_nonzero(mask))
    orientation = np.zeros(mask.shape, np.float32)
    orientation[mask] = _from_base64(stored, "orientation", inside, "<f4")
    if not ((orientation >= 0.0) & (orientation <= np.pi)).all():
        raise TemplateError("ridge_field: orientation must lie from 0 to π")
    ridges = None
    if "ridges" in stored:
        ridges = np.zeros(mask.shape, np.uint64)
        ridges[mask] = _from_base64(stored, "ridges", inside, "<u8")
    return RidgeField(_number(stored, "step"), orientation, mask, ridges)


def _to_base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")


def _from_base64(stored: dict[str, Any], name: str, count: int, dtype: str = "u1") -> NDArray[Any]:
    """Return the `count` numbers under `name`."""
    try:
        data = base64.b64decode(_member(stored, name, str), validate=True)
    except (binascii.Error, ValueError) as error:
        raise TemplateError(f"ridge_field: {name} is not base64 ({error})") from error
    length = count * np.dtype(dtype).itemsize
    if len(data) != length:
        raise TemplateError(f"ridge_field: {name} has {len(data)} bytes, expected {length}")
    return np.frombuffer(data, dtype)


CODEC: Final = Codec("json", "fpmatch JSON 2", (".json",), _recognises, decode, encode)
