"""Find the codec of a template file: by its content on reading, by its suffix on writing."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, Final

from fpmatch.errors import TemplateError
from fpmatch.formats import csv_format, json_format

if TYPE_CHECKING:
    import os

    from fpmatch.formats.codec import Codec

# A new format is a module with a CODEC and its name here, the stricter recognisers first.
CODECS: Final = (csv_format.CODEC, json_format.CODEC)


def codec_of_content(data: bytes) -> Codec:
    """Return the codec that recognises `data`.

    Raises
    ------
    TemplateError
        If none does.
    """
    for codec in CODECS:
        if codec.recognises(data):
            return codec
    raise TemplateError("not a template file of a known format")


def codec_of_suffix(path: str | os.PathLike[str]) -> Codec:
    """Return the codec whose suffix `path` carries, in any case.

    Raises
    ------
    TemplateError
        If none does.
    """
    suffix = PurePath(path).suffix.lower()
    for codec in CODECS:
        if codec.suffix == suffix:
            return codec
    known = ", ".join(codec.suffix for codec in CODECS)
    raise TemplateError(f"{path}: no template format has the suffix {suffix!r} (known: {known})")
