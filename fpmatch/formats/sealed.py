"""Sealed templates: fpmatch's JSON format under authenticated encryption.

A file is a sealed record (`fpmatch.base.encryption.records`) with the bytes of a JSON template. The
keys come from the environment variable ``FPMATCH_KEY``, which the option ``--key`` of commands
sets.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from fpmatch.base.encryption.keys import keys_for, load_keys
from fpmatch.base.encryption.records import is_sealed, key_id_of, seal, unseal
from fpmatch.errors import TemplateError
from fpmatch.formats import json_format
from fpmatch.formats.codec import Codec

if TYPE_CHECKING:
    from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

NAME: Final = "sealed"
_PURPOSE: Final = b"template"


def require_key(file_format: str) -> None:
    """Raise EncryptionError, before any work, where files of a format cannot be written."""
    if file_format == NAME:
        load_keys()


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes sealed with the current key, or raise EncryptionError."""
    encoded = json_format.encode(record)
    return replace(encoded, data=seal(load_keys().current, encoded.data, purpose=_PURPOSE))


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the template in a file; raise EncryptionError without its key, or if it is damaged."""
    if not options.unseal:
        raise TemplateError("a sealed template, which is not opened here", code="sealed")
    content = unseal(keys_for(key_id_of(data)), data, purpose=_PURPOSE)
    return replace(json_format.decode(content, options), format=NAME)


CODEC: Final = Codec(NAME, "sealed template", (".sealed",), is_sealed, decode, encode)
