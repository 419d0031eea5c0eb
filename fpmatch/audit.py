"""The audit log: who requested what and when, one line an event, chained by hashes.

Each line contains the SHA-256 of the line before it, so that a line that is changed, removed or
inserted is found. That the last lines are missing cannot be seen from the file alone: keep its
number of lines and last hash elsewhere.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import FpmatchError
from fpmatch.output import reason

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

START: Final = "0" * 64  # what the first line contains in place of a hash
_OWNER_ONLY: Final = 0o600
_LONGEST_LINE: Final = 1 << 20
_RESERVED: Final = ("time", "previous")


class AuditError(FpmatchError):
    """An audit log cannot be read or written, or was changed."""


@dataclass(frozen=True, slots=True)
class AuditState:
    """Hold how many events an audit log contains, and the hash of its last line."""

    events: int
    last: str


class AuditLog:
    """Append events to a file that is never rewritten.

    Several processes may append to one file.

    Parameters
    ----------
    path : path-like
        The file; made where it is missing, for its owner only.

    Raises
    ------
    AuditError
        If the file cannot be written.

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
        from filelock import FileLock  # noqa: PLC0415  (of an extra)

        self.path = Path(path)
        self._lock = FileLock(f"{path}.lock", mode=_OWNER_ONLY)
        try:
            os.close(os.open(self.path, os.O_CREAT | os.O_APPEND | os.O_WRONLY, _OWNER_ONLY))
        except OSError as error:
            raise AuditError(f"cannot be written: {reason(error)}", path=path) from error

    def append(self, client: str, action: str, details: Mapping[str, Any]) -> None:
        """Append one event.

        Parameters
        ----------
        client : str
            Who requested it.
        action : str
            What was requested.
        details : mapping
            JSON values: entries, outcome. Never pictures or templates.

        Raises
        ------
        AuditError
            If the file cannot be written.
        """
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        try:
            with self._lock, self.path.open("r+b") as stream:
                event = {
                    "time": now,
                    "client": client,
                    "action": action,
                    **details,
                    "previous": _last_hash(stream),
                }
                stream.seek(0, os.SEEK_END)
                stream.write(json.dumps(event, allow_nan=False).encode() + b"\n")
                stream.flush()
                os.fsync(stream.fileno())
        except OSError as error:
            raise AuditError(f"cannot be written: {reason(error)}", path=self.path) from error


def read_audit_log(path: str | os.PathLike[str]) -> Iterator[dict[str, Any]]:
    """Yield the events of an audit log, each checked against the line before it.

    Parameters
    ----------
    path : path-like
        The file.

    Yields
    ------
    dict
        ``time``, ``client``, ``action``, the details, and ``previous``.

    Raises
    ------
    AuditError
        If the file cannot be read, or a line was changed, removed or inserted; the message names
        the line.
    """
    previous = START
    try:
        with Path(path).open("rb") as stream:
            for number, line in enumerate(stream, 1):
                try:
                    event = json.loads(line)
                except (ValueError, RecursionError):
                    event = None
                if not isinstance(event, dict) or not line.endswith(b"\n"):
                    raise AuditError(f"line {number} is damaged", path=path, code="damaged")
                if event.get("previous") != previous:
                    raise AuditError(
                        f"line {number} does not follow the line before it: a line was changed, "
                        "removed or inserted",
                        path=path,
                        code="changed",
                    )
                previous = hashlib.sha256(line).hexdigest()
                yield event
    except OSError as error:
        raise AuditError(f"cannot be read: {reason(error)}", path=path) from error


def check_audit_log(path: str | os.PathLike[str]) -> AuditState:
    """Check all lines of an audit log against one another.

    Returns
    -------
    AuditState
        The number of events and the last hash: with those noted earlier, they show that no line
        is missing at the end.

    Raises
    ------
    AuditError
        As for `read_audit_log`.
    """
    events = 0
    for events, _ in enumerate(read_audit_log(path), 1):  # noqa: B007
        pass
    with Path(path).open("rb") as stream:
        return AuditState(events, _last_hash(stream))


def _last_hash(stream: Any) -> str:
    """Return the hash of the last line of an open file."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - _LONGEST_LINE))
    lines = stream.read().splitlines(keepends=True)
    return hashlib.sha256(lines[-1]).hexdigest() if lines else START
