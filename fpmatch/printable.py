r"""Text of foreign origin (names, tags, labels, messages) as it may be shown, stored and sent.

A name of a file may contain any byte, and a tag or a label any character: bytes that are not UTF-8,
escape sequences that a terminal obeys, ends of lines, controls that reorder what is read. Each such
character becomes a backslash escape, ``\xff`` or ``\u202e``; all others stay as they are. Tables as
text, and numbers with nouns, are made here, too.
"""

from __future__ import annotations

import re
import sys

TYPE_CHECKING = False  # the command line imports this before anything else
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TextIO

_SURROGATE = re.compile("[\ud800-\udfff]")
# C0, DEL, C1; separators of lines and paragraphs; controls of direction; surrogates.
_UNSAFE = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
_UNSAFE_IN_LINES = re.compile(_UNSAFE.pattern.replace("\x00-\x1f", "\x00-\x09\x0b-\x1f"))
_NAMED = {"\n": r"\n", "\r": r"\r", "\t": r"\t"}
MOST_SHOWN = 2000  # characters of a message
_BYTES = 0xDC00  # added to a byte that is not UTF-8, Python keeps it as a character
_FIRST_BYTE, _LAST_BYTE = _BYTES + 0x80, _BYTES + 0xFF


def printable(text: object) -> str:
    """Return text on one line without characters that act on a terminal or hide what is there.

    It is the same when it is applied again.
    """
    return _UNSAFE.sub(_escape, str(text))


def message_text(text: object) -> str:
    """Return `printable` text for a message: of more than 2,000 characters, both ends."""
    shown = printable(text)
    if len(shown) <= MOST_SHOWN:
        return shown
    half = (MOST_SHOWN - 3) // 2
    return f"{shown[: MOST_SHOWN - 3 - half]} … {shown[-half:]}"


def printable_lines(text: str) -> str:
    """Return several lines of text as `printable` returns each."""
    return _UNSAFE_IN_LINES.sub(_escape, text)


def as_text(text: object) -> str:
    """Return text, or a path, that UTF-8 can encode: bytes that are not UTF-8 are escaped.

    Other control characters stay: names are the same in a database as in the file system.
    """
    return _SURROGATE.sub(_escape, str(text))


def as_file_name(text: str) -> str:
    """Return the name that `as_text` or `printable` has made of a name of a file."""
    return re.sub(r"\\(?:x([0-9a-f]{2})|u([0-9a-f]{4})|([nrt]))", _unescape, text)


def json_text(document: object, *, indent: int | None = 2) -> str:
    """Return the text of a JSON value, in ASCII and valid for every reader.

    Characters that are not ASCII are JSON's own escapes, and read back as they were; surrogates
    alone, which strict readers refuse, are escaped as by `as_text`.
    """
    import json  # noqa: PLC0415  (most errors need none)

    text = json.dumps(document, allow_nan=False, ensure_ascii=False)
    if _SURROGATE.search(text):
        escaped = _SURROGATE.sub(lambda one: _escape(one).replace("\\", "\\\\"), text)
        document = json.loads(escaped)
    return json.dumps(document, indent=indent, allow_nan=False).replace("\x7f", r"\u007f")


def as_encodable(text: str, stream: TextIO | None = None) -> str:
    """Return text that a stream (default: stdout) can encode; what it cannot is escaped."""
    encoding = getattr(stream or sys.stdout, "encoding", None) or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


def _escape(match: re.Match[str]) -> str:
    code = ord(match[0])
    if _FIRST_BYTE <= code <= _LAST_BYTE:
        return f"\\x{code - _BYTES:02x}"
    return _NAMED.get(match[0]) or (f"\\x{code:02x}" if code < 0x80 else f"\\u{code:04x}")


def _unescape(match: re.Match[str]) -> str:
    byte, code, letter = match.groups()
    if letter:
        return {"n": "\n", "r": "\r", "t": "\t"}[letter]
    number = int(byte or code, 16)
    if byte and number >= 0x80:  # a byte that was not UTF-8
        number += _BYTES
    return chr(number)


def count(number: int, noun: str, plural: str = "") -> str:
    """Return a number and its noun, in the plural (default: with an s) unless it is one."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def rotation_text(degrees: float) -> str:
    """Return a rotation with its sense on screen, where y points down.

    >>> rotation_text(30), rotation_text(-0.01)
    ('30.0° (clockwise)', '0.0°')
    """
    if abs(degrees) < 0.05:
        return "0.0°"
    return f"{degrees:.1f}° ({'clockwise' if degrees > 0 else 'counter-clockwise'})"


def text_table(rows: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Return rows of cells as aligned columns, the first `left` of them to the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    align = [str.ljust if k < left else str.rjust for k in range(len(widths))]
    return "\n".join(
        "  ".join(put(cell, n) for put, cell, n in zip(align, row, widths, strict=True)).rstrip()
        for row in rows
    )
