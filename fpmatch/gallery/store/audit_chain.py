"""The chain of audit events: one line an event, chained by hashes.

Each line contains the SHA-256 of the line before it, so that a line that is changed, removed or
inserted is found. That the last lines are missing cannot be seen from the lines alone: keep their
number and the last hash elsewhere. Lines that were copied from a gallery
(`fpmatch.gallery.store.audit`) into a file are checked alike.
"""

from __future__ import annotations

import hashlib
import os
import platform
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

from fpmatch.base.output import reason
from fpmatch.base.parsing import ParseError, parse_json
from fpmatch.errors import FpmatchError
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

Result = TypeVar("Result")

START: Final = "0" * 64  # what the first line contains in place of a hash
_LONGEST_LINE: Final = 1 << 26
OPERATOR: Final = "FPMATCH_OPERATOR"  # environment variable: who uses the commands
_client: ContextVar[str | None] = ContextVar("fpmatch_client", default=None)


class AuditError(FpmatchError):
    """An audit cannot be read or written, or was changed."""


@dataclass(frozen=True, slots=True)
class AuditState:
    """The number of lines of an audit, and the hash of the last."""

    events: int = 0
    last: str = START


def hash_of(line: bytes) -> str:
    """Return the hash by which the next line refers to a line."""
    return hashlib.sha256(line).hexdigest()


def event_line(previous: str, client: str, action: str, details: Mapping[str, Any]) -> bytes:
    """Return the line of an event that happens now, after the line whose hash is `previous`.

    Raises ValueError if `details` are no JSON values.
    """
    now = datetime.now(UTC).isoformat(timespec="milliseconds")
    event = {"time": now, "client": client, "action": action, **details, "previous": previous}
    return json_text(event, indent=None).encode() + b"\n"


def follow_chain(
    lines: Iterable[bytes], place: object
) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """Yield number, hash and event of each line, checked against the line before it.

    Raises AuditError, which names the line, if one was changed, removed or inserted, or is damaged.
    """
    previous = START
    for number, line in enumerate(lines, 1):
        event = parse_line(line)
        if event is None:
            raise AuditError(f"line {number} is damaged", path=place, code="damaged")
        if event.get("previous") != previous:
            raise AuditError(
                f"line {number} does not follow the line before it: a line was changed, "
                "removed or inserted",
                path=place,
                code="changed",
            )
        previous = hash_of(line)
        yield number, previous, event


def check_audit_log(
    path: str | os.PathLike[str], *, expect: tuple[int, str] | None = None
) -> AuditState:
    """Check the lines in a file, as `check_chain`; AuditError if it cannot be read, too."""
    return check_chain(log_lines(path), path, expect=expect)


def log_lines(path: str | os.PathLike[str]) -> Iterator[bytes]:
    """Yield the lines of a file as they are; AuditError where it cannot be read."""
    try:
        with Path(path).open("rb") as stream:
            while line := stream.readline(_LONGEST_LINE):
                yield line
    except OSError as error:
        raise AuditError(f"cannot be read: {reason(error)}", path=path) from error


def check_chain(
    lines: Iterable[bytes], place: object, *, expect: tuple[int, str] | None = None
) -> AuditState:
    """Check lines against one another and, with `expect`, against an earlier number and hash.

    Raises AuditError as `follow_chain`; with `expect`, also if there are fewer lines (code
    "shortened"), or the line of that number has another hash (code "changed").
    """
    events, last = 0, START
    for events, last, _ in follow_chain(lines, place):
        if expect is not None and events == expect[0] and last != expect[1]:
            why = f"line {events} is not the one expected: the lines up to it were written anew"
            raise AuditError(why, path=place, code="changed")
    if expect is not None and events < expect[0]:
        why = f"has {events} lines, not the {expect[0]} expected: the last ones were removed"
        raise AuditError(why, path=place, code="shortened")
    return AuditState(events, last)


def parse_line(line: bytes) -> dict[str, Any] | None:
    """Return the event of a line, or None where it is none."""
    try:
        event = parse_json(line) if line.endswith(b"\n") else None
    except ParseError:
        return None
    return event if isinstance(event, dict) else None


@contextmanager
def acting_as(client: str) -> Iterator[None]:
    """Name who requests what is done inside the block.

    Examples
    --------
    >>> with acting_as("ada"):
    ...     current_client()
    'ada'
    """
    token = _client.set(client)
    try:
        yield
    finally:
        _client.reset(token)


def act_as(client: str, work: Callable[..., Result], *args: Any) -> Result:
    """Return ``work(*args)``, done for a client; for other processes."""
    with acting_as(client):
        return work(*args)


def current_client() -> str:
    """Return who requests this: of `acting_as`, else $FPMATCH_OPERATOR, else user and host."""
    if (named := _client.get()) is not None:
        return named
    system = f"{_system_user()}@{platform.node() or 'localhost'}"
    operator = os.environ.get(OPERATOR, "").strip()
    return f"{operator} ({system})" if operator else system


def _system_user() -> str:
    """Return the user of this process as the system has it, not its environment."""
    try:
        import pwd  # noqa: PLC0415  (not on Windows)

        return pwd.getpwuid(os.getuid()).pw_name
    except (ImportError, KeyError):
        import getpass  # noqa: PLC0415

        with suppress(Exception):
            return getpass.getuser()
        return str(os.getuid()) if hasattr(os, "getuid") else "unknown"
