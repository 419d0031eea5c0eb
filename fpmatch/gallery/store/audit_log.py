"""The audit log of a server: a file of chained lines that is only appended to."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final

from fpmatch.base.folders import create_private
from fpmatch.base.output import PRIVATE_FILE, reason
from fpmatch.gallery.store.audit_chain import (
    INCOMPLETE,
    START,
    AuditError,
    AuditState,
    check_chain,
    event_line,
    hash_of,
    parse_line,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

LOCK_S: Final = 60.0  # to wait for another program that appends
_LONGEST_LINE: Final = 1 << 26
_BLOCK: Final = 1 << 12


class AuditLog:
    """Append events to a file that is never rewritten; it is made for its owner only.

    Several processes may append to one file. Where a program was stopped within a line, the next
    event is preceded by one that states it. Raises AuditError if the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log = AuditLog(Path(folder, "audit.jsonl"))
    ...     log.append("ada", "identify", {"candidates": [3]})
    ...     log.append("ada", "remove", {"entries": [3]})
    ...     check_audit_log(log.path).events
    2
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        from filelock import FileLock  # noqa: PLC0415

        self.path = Path(path)
        self._lock = FileLock(f"{path}.lock", timeout=LOCK_S, mode=PRIVATE_FILE)
        try:
            create_private(self.path)
            os.close(os.open(self.path, os.O_APPEND | os.O_WRONLY))
        except OSError as error:
            raise AuditError(f"cannot be written: {reason(error)}", path=path) from error

    def append(self, client: str, action: str, details: Mapping[str, Any]) -> None:
        """Append one event: who requested what, and JSON values, never pictures or templates."""
        try:
            with self._lock, _open_to_append(self.path) as stream:
                last, torn = _tail(stream, self.path)
                written = b"\n" if torn else b""
                if parse_line(torn + b"\n") is not None:  # lacks its end only
                    last = hash_of(torn + b"\n")
                elif torn:
                    stated = {"bytes": len(torn), "after": last}
                    note = event_line(hash_of(torn + b"\n"), "-", INCOMPLETE, stated)
                    last, written = hash_of(note), written + note
                _write(stream, written + event_line(last, client, action, details))
        except OSError as error:
            raise AuditError(f"cannot be written: {reason(error)}", path=self.path) from error


def check_audit_log(
    path: str | os.PathLike[str], *, expect: tuple[int, str] | None = None
) -> AuditState:
    """Check all lines of an audit log, as `check_chain`; AuditError if it cannot be read, too."""
    return check_chain(log_lines(path), path, expect=expect)


def log_lines(path: str | os.PathLike[str]) -> Iterator[bytes]:
    """Yield the lines of a file as they are; AuditError where it cannot be read."""
    try:
        with Path(path).open("rb") as stream:
            number = 0
            while line := stream.readline(_LONGEST_LINE):
                number += 1
                if len(line) == _LONGEST_LINE:
                    raise AuditError(f"line {number} is damaged", path=path, code="damaged")
                yield line
    except OSError as error:
        raise AuditError(f"cannot be read: {reason(error)}", path=path) from error


def _open_to_append(path: Path) -> BinaryIO:
    """Open a file so that the system itself writes at its end only."""
    flags = os.O_RDWR | os.O_APPEND | getattr(os, "O_BINARY", 0)
    return os.fdopen(os.open(path, flags), "r+b")


def _tail(stream: BinaryIO, path: Path) -> tuple[str, bytes]:
    """Return the hash of the last whole line, and the bytes of an incomplete one after it."""
    size = stream.seek(0, os.SEEK_END)
    block = _BLOCK
    while True:
        start = stream.seek(max(0, size - block))
        *whole, torn = stream.read(size - start).split(b"\n")
        lines = [line + b"\n" for line in whole]
        first = int(start > 0)  # the first line read may begin before the block
        whole_end = not torn or parse_line(torn + b"\n") is not None
        for k in range(len(lines) - 1, first - 1, -1):
            if whole_end or parse_line(lines[k]) is not None:
                return hash_of(lines[k]), b"".join(lines[k + 1 :]) + torn
        if not start:
            return START, b"".join(lines) + torn
        if block > _LONGEST_LINE:
            raise AuditError("its last line is damaged", path=path, code="damaged")
        block *= 2


def _write(stream: BinaryIO, data: bytes) -> None:
    """Append all of `data` and wait until the disk has it; else leave as little as possible."""
    size = stream.seek(0, os.SEEK_END)
    try:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
    except OSError:
        with suppress(OSError):
            os.ftruncate(stream.fileno(), size)
        raise
