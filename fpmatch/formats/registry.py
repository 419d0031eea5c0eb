"""Find the codec of a template file: by its content on reading, by its suffix on writing."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, Final, cast

from fpmatch.errors import TemplateError
from fpmatch.formats import (
    an2,
    csv_format,
    fmr_2005,
    fmr_2011,
    json_format,
    min_format,
    xyt,
)
from fpmatch.formats.fmr_header import MAGIC
from fpmatch.plugins import FORMATS, load_plugins

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from fpmatch.formats.codec import Codec

# A new format is a module with a CODEC and its name here, the stricter ones first; or the codec of
# another package, see `fpmatch.plugins`.
CODECS: Final = (
    csv_format.CODEC,
    csv_format.PLAIN_CODEC,
    json_format.CODEC,
    fmr_2005.ISO_CODEC,
    fmr_2011.ISO_CODEC,
    fmr_2005.ANSI_CODEC,
    fmr_2011.ANSI_CODEC,
    fmr_2011.AMENDED_CODEC,
    an2.CODEC,
    min_format.CODEC,
    xyt.M1_CODEC,
    xyt.CODEC,
)


def codec_of_content(data: bytes) -> Codec:
    """Return the codec that recognises `data`, a file or its first few thousand bytes.

    Raises TemplateError if none does; for a finger minutiae record it names the version.
    """
    for codec in CODECS:
        if codec.recognises(data):
            return codec
    plugins = load_plugins(FORMATS)
    for codec in plugins.loaded.values():
        if codec.recognises(data):
            return cast("Codec", codec)
    if data.startswith(MAGIC):
        version = data[4:7].decode("ascii", "replace").strip()
        raise TemplateError(
            f"a finger minutiae record (ISO/IEC 19794-2, ANSI/INCITS 378) of version {version!r}, "
            "which is not known"
        )
    failed = "".join(f"; {why}" for why in plugins.failures.values())
    raise TemplateError(f"not a template file of a known format{failed}")


def codec_of_suffix(path: str | os.PathLike[str]) -> Codec:
    """Return the codec that writes files with the suffix of `path`; raises TemplateError."""
    suffix = PurePath(path).suffix.lower()
    for codec in _own_then_others():
        if codec.encode is not None and suffix in codec.suffixes:
            return codec
    written = [codec for codec in _own_then_others() if codec.encode is not None]
    known = ", ".join(dict.fromkeys(codec.suffixes[0] for codec in written))
    raise TemplateError(f"{path}: no template format has the suffix {suffix!r} (known: {known})")


def codec_of_name(name: str) -> Codec:
    """Return the codec of the format `name`; raises TemplateError if there is none."""
    for codec in _own_then_others():
        if codec.name == name:
            return codec
    known = ", ".join(codec.name for codec in _own_then_others())
    raise TemplateError(f"unknown template format {name!r} (known: {known})")


def written_formats() -> list[str]:
    """Return the names of the formats that can be written."""
    return [codec.name for codec in _own_then_others() if codec.encode is not None]


def _own_then_others() -> Iterator[Codec]:
    """Yield the codecs of this package, then those of others, which are loaded if it comes to it."""
    yield from CODECS
    yield from load_plugins(FORMATS).loaded.values()
