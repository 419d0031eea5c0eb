"""Find the codec of a template file: by its content on reading, by its suffix on writing."""

from __future__ import annotations

import warnings
from functools import partial
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.plugins import (
    AN2_SIGNATURES,
    FMR_SIGNATURE,
    FORMATS,
    PluginError,
    agency,
    load_plugin,
    load_plugins,
    plugin_names,
)
from fpmatch.errors import FpmatchError, TemplateError, unknown_name
from fpmatch.formats import fmr, json_format, tables, xyt
from fpmatch.formats.record import Codec, Encoded, TemplateRecord

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator


def _recognises(signatures: tuple[bytes, ...], module: str, name: str, data: bytes) -> bool:
    """Return whether a function of a module of agencies recognises a file with a signature."""
    try:
        return data.startswith(signatures) and bool(_call(module, name, data))
    except PluginError:  # which reading it raises again
        return True


def _call(module: str, name: str, *given: Any) -> Any:
    """Call a function of a module of agencies, which loads with the first of its files."""
    return getattr(agency(module), name)(*given)


_2009: Final = (FMR_SIGNATURE + b"030\x00", FMR_SIGNATURE + b"035\x00")  # the second: amended
ISO_2011: Final = Codec(
    "iso2011",
    "ISO/IEC 19794-2:2011",
    (".iso2011",),
    partial(_recognises, _2009[:1], "fmr_2011", "is_iso"),
    partial(_call, "fmr_2011", "decode_iso"),
)
ANSI_2009: Final = Codec(
    "ansi2009",
    "ANSI/INCITS 378-2009",
    (".ansi2009",),
    partial(_recognises, _2009, "fmr_2011", "is_ansi"),
    partial(_call, "fmr_2011", "decode_ansi"),
)
AN2: Final = Codec(
    "an2",
    "ANSI/NIST-ITL, type 9",
    (".an2", ".an2k", ".eft"),
    partial(_recognises, AN2_SIGNATURES, "an2", "holds_minutiae"),
    partial(_call, "an2", "decode"),
)

# A new format is a module with a CODEC and its name here, the stricter ones first; or the codec of
# another package, see `fpmatch.base.plugins`.
CODECS: Final = (
    tables.CODEC,
    json_format.CODEC,
    fmr.ISO_CODEC,
    ISO_2011,
    fmr.ANSI_CODEC,
    ANSI_2009,
    AN2,
    xyt.M1_CODEC,
    xyt.CODEC,
    tables.NPY_CODEC,
    tables.PLAIN_CODEC,
    tables.TEXT_CODEC,
)
_GENERAL: Final = 2  # the last ones, after the formats of other packages, which may be narrower


def recognise(data: bytes) -> Codec | None:
    """Return the codec that recognises `data`, a file or its first few thousand bytes; else None.

    Raises TemplateError for a finger minutiae record of another version.
    """
    codec = next((one for one in known_codecs() if one.recognises(data)), None)
    if codec is None and data.startswith(FMR_SIGNATURE):
        version = data[4:7].decode("ascii", "replace").strip()
        raise TemplateError(
            f"a finger minutiae record (ISO/IEC 19794-2, ANSI/INCITS 378) of version {version!r}, "
            "which is not known"
        )
    return codec


def codec_of_suffix(path: str | os.PathLike[str]) -> Codec:
    """Return the codec that writes files with the suffix of `path`; raises TemplateError."""
    suffix = PurePath(path).suffix.lower()
    written = [codec for codec in known_codecs() if codec.encode is not None]
    for codec in written:
        if suffix in codec.suffixes:
            return codec
    known = ", ".join(dict.fromkeys(codec.suffixes[0] for codec in written))
    raise TemplateError(f"{path}: no template format has the suffix {suffix!r} (known: {known})")


def codec_of_name(name: str) -> Codec:
    """Return the codec of the format `name`; raises TemplateError if there is none."""
    for codec in CODECS:
        if codec.name == name:
            return codec
    if name not in plugin_names(FORMATS):
        known = [*(codec.name for codec in CODECS), *plugin_names(FORMATS)]
        raise TemplateError(unknown_name("template format", name, known))
    try:
        return _guarded(load_plugin(FORMATS, name))
    except PluginError as error:
        raise TemplateError(f"format {name}: {error}", code="plug-in") from error


def written_formats() -> list[str]:
    """Return the names of the formats of this package that can be written."""
    return [codec.name for codec in CODECS if codec.encode is not None]


def known_codecs() -> Iterator[Codec]:
    """Yield the package's codecs, those of others, imported only then, and those of tables."""
    yield from CODECS[:-_GENERAL]
    own = {codec.name for codec in CODECS}
    for name, codec in load_plugins(FORMATS)[0].items():
        if name not in own:
            yield _guarded(codec)
    yield from CODECS[-_GENERAL:]


def failures_text() -> str:
    """Return why formats of other packages cannot be loaded, to be added to a message."""
    return "".join(f"; {why}" for why in load_plugins(FORMATS)[1].values())


def _guarded(codec: Codec) -> Codec:
    """Return a codec of another package whose faults are TemplateErrors that name it.

    A file that it fails to recognise, which may be of any format, is not its own.
    """

    def recognises(data: bytes) -> bool:
        try:
            return bool(codec.recognises(data))
        except Exception as error:  # noqa: BLE001  (its faults do not concern other formats)
            warnings.warn(f"format {codec.name}: recognises: {error!r}", stacklevel=2)
            return False

    def call(function: Callable[..., Any], kind: type, *given: Any) -> Any:
        try:
            result = function(*given)
            if not isinstance(result, kind):
                raise TypeError(f"returned {type(result).__name__}, not {kind.__name__}")
            return result
        except FpmatchError:
            raise
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise TemplateError(f"format {codec.name}: {reason}") from error

    decode = partial(call, codec.decode, TemplateRecord)
    encode = None if codec.encode is None else partial(call, codec.encode, Encoded)
    return Codec(codec.name, codec.title, tuple(codec.suffixes), recognises, decode, encode)
