"""The bytes of files, and texts of JSON and TOML, parsed with one kind of error."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NoReturn

if TYPE_CHECKING:
    import os
    from collections.abc import Callable


HEAD_BYTES: Final = 4096  # enough to recognise a format
MOST_DOTS: Final = 1000  # of a key of TOML: `tomllib` takes time by their square
_BETWEEN_KEYS: Final = re.compile(r"[=\n]")


class ParseError(ValueError):
    """A text is not JSON or TOML, or nested or with numbers beyond what can be read."""


def read_head(path: str | os.PathLike[str]) -> bytes:
    """Return the first bytes of a regular file; none where it cannot be read."""
    file = Path(path)
    try:
        if file.is_file():
            with file.open("rb") as stream:
                return stream.read(HEAD_BYTES)
    except (OSError, ValueError):
        pass
    return b""


def read_regular(
    path: str | os.PathLike[str],
    most: int,
    error: Callable[[str], Exception],
    others: tuple[str, str],
) -> bytes:
    """Return up to `most` + 1 bytes of a regular file; raise ``error(reason)`` if it fails.

    `others` names what is there instead, a folder or something else.
    """
    file = Path(path)
    try:
        if not file.exists():
            raise error("no such file")
        if not file.is_file():
            raise error(f"is {others[0 if file.is_dir() else 1]}")
        with file.open("rb") as stream:
            return stream.read(most + 1)
    except (OSError, ValueError) as why:
        reason = why.strerror if isinstance(why, OSError) else None
        raise error(reason or str(why)) from why


def parse_json(text: str | bytes) -> Any:
    """Return the value of a text of JSON, in UTF-8 with or without a byte order mark.

    Raises ParseError, whose message is one line, for anything else: NaN and Infinity, which are not
    JSON, half of a surrogate pair in a string, numbers of thousands of digits, deep nesting.
    """
    try:
        decoded = (text.decode() if isinstance(text, bytes) else text).removeprefix("\ufeff")
        value = json.loads(decoded, parse_constant=_refuse)
        if "\\ud" in decoded.lower():
            json.dumps(value, ensure_ascii=False).encode()
    except (ValueError, RecursionError) as error:
        raise ParseError(_reason(error)) from error
    return value


def parse_toml(text: str | bytes) -> dict[str, Any]:
    """Return the table of a text of TOML in UTF-8; raise ParseError as `parse_json` does."""
    import tomllib  # noqa: PLC0415  (most commands read none)

    try:
        decoded = text if isinstance(text, str) else text.decode()
        if any(part.count(".") > MOST_DOTS for part in _BETWEEN_KEYS.split(decoded)):
            raise ParseError(f"a key with more than {MOST_DOTS} parts")
        return tomllib.loads(decoded)
    except (ValueError, RecursionError) as error:
        raise ParseError(_reason(error)) from error


def _reason(error: ValueError | RecursionError) -> str:
    """Return what is wrong with a text, on one line, from the error of a parser."""
    if isinstance(error, RecursionError):
        return "nested too deeply"
    if isinstance(error, UnicodeEncodeError):
        return "a string holds half of a surrogate pair"
    if isinstance(error, UnicodeDecodeError):
        return f"not text in UTF-8: byte 0x{error.object[error.start]:02x} at {error.start}"
    why = next(iter(str(error).splitlines()), "")
    return "a number has too many digits" if "int_max_str" in why else why


def _refuse(constant: str) -> NoReturn:
    raise ParseError(f"{constant} is not a number")
