"""The log of a server: its form, and a bound on lines that clients can cause."""

from __future__ import annotations

import logging
import secrets
import sys
from time import monotonic
from typing import Any, Final

_PAUSE_S: Final = 1.0  # between two lines of a kind
_KEPT_S: Final = 60.0  # that a kind is remembered


class OncePerSecond(logging.Filter):
    """Pass one warning or error of a kind a second; the next states how many were left out.

    Of a kind are those of one logger and level whose message is the same before its values are put
    in, and whose exceptions, if any, are of one type. Other lines pass.
    """

    def __init__(self) -> None:
        super().__init__()
        self._latest: dict[Any, tuple[float, int]] = {}  # by kind: when, and left out since then

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a line is to be written."""
        if record.levelno < logging.WARNING:
            return True
        error = record.exc_info[0] if record.exc_info else None
        kind = record.name, record.levelno, str(record.msg), error
        now = monotonic()
        written, left_out = self._latest.get(kind, (-_PAUSE_S, 0))
        if now - written < _PAUSE_S:
            self._latest[kind] = written, left_out + 1
            return False
        self._latest = {
            known: entry for known, entry in self._latest.items() if now - entry[0] < _KEPT_S
        }
        self._latest[kind] = now, 0
        if left_out:
            record.msg, record.args = f"{record.getMessage()} ({left_out} more before)", None
        return True


class Incidents:
    """Log the reasons of failed requests, each with an identifier that its answer states, too.

    The same reason within a second is the same incident.
    """

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._latest: dict[str, tuple[float, str]] = {}  # by reason: when, and identifier

    def report(self, reason: str, error: BaseException | None = None) -> str:
        """Return the identifier under which the log has a reason."""
        now = monotonic()
        self._latest = {
            known: entry for known, entry in self._latest.items() if now - entry[0] < _PAUSE_S
        }
        if reason not in self._latest:
            self._latest[reason] = now, secrets.token_hex(4)
            # the reason is a part of the message, for `OncePerSecond`
            self._log.error(f"{self._latest[reason][1]}: {reason}", exc_info=error)
        return self._latest[reason][1]


def set_up_logging(form: str, stream: Any = None) -> None:
    """Let this process write its log to a stream (default: stderr), a line an event.

    The form is "none" (warnings and errors only, as text), "text" or "json".
    """
    handler = logging.StreamHandler(stream or sys.stderr)
    words = "%(asctime)s %(levelname)s %(name)s %(message)s"
    if form == "json":
        from pythonjsonlogger.json import JsonFormatter  # noqa: PLC0415

        handler.setFormatter(JsonFormatter(words, timestamp="time"))
    else:
        handler.setFormatter(logging.Formatter(words))
    handler.addFilter(OncePerSecond())
    root = logging.getLogger()
    for former in root.handlers[:1]:
        root.removeHandler(former)
    root.addHandler(handler)
    root.setLevel(logging.WARNING)
    access = logging.getLogger("fpmatch.access")
    access.setLevel(logging.WARNING if form == "none" else logging.INFO)
