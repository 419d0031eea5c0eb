"""Auditor: appends events of requests to the audit log, in order, without holding up others."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, Final

import anyio
from anyio import to_thread

from fpmatch.gallery.store.audit_chain import AuditError
from fpmatch.gallery.store.audit_log import AuditLog
from fpmatch.server.errors import RequestError, send_error
from fpmatch.server.guard import CLIENT

if TYPE_CHECKING:
    from starlette.types import Message, Scope, Send

AUDITED: Final = "fpmatch.audited"  # key of what the audit log states, in the scope of a request
REQUEST: Final = "fpmatch.request"  # key of the number of a request, in its scope
AUDITOR: Final = "fpmatch.auditor"
_REFUSAL: Final = "the audit log cannot be written"
_HEADERS: Final = ((b"cache-control", b"no-store"), (b"x-content-type-options", b"nosniff"))
_log: Final = logging.getLogger(__name__)


class Auditor:
    """Append events of requests to the audit log, if there is one.

    A thread does so, one event after the other. A response is sent when its event is stored, and
    is replaced by status 503 where it cannot be. Raises AuditError if its file cannot be written.
    """

    def __init__(self, path: str | None) -> None:
        self._log = None if path is None else AuditLog(path)
        self._turn = anyio.CapacityLimiter(1)

    async def begin(self, scope: Scope) -> None:
        """Store that a request is about to change something; RequestError if that fails."""
        try:
            await self.store(scope, begun=True)
        except AuditError:
            raise RequestError(f"{_REFUSAL}: nothing was done", status=503) from None

    async def store(self, scope: Scope, **stated: Any) -> None:
        """Store what `scope` contains of a request; AuditError, which is logged, if that fails."""
        details = scope.get(AUDITED)
        if self._log is None or details is None:
            return
        client = scope.get(CLIENT)
        name = "-" if client is None else client.name
        action = f"{scope['method']} {route_of(scope)}"
        event = {"request": scope[REQUEST], **stated, **details}
        try:
            with anyio.CancelScope(shield=True):
                await to_thread.run_sync(self._log.append, name, action, event, limiter=self._turn)
        except AuditError as error:
            _log.error("%s", error)
            raise

    def guarded(self, scope: Scope, send: Send) -> Send:
        """Return a `send` that stores the event of a request before its response."""
        refused = False

        async def sending(message: Message) -> None:
            nonlocal refused
            if message["type"] == "http.response.start":
                try:
                    await self.store(scope, status=message["status"])
                except AuditError:
                    refused = True
                    await send_error(send, 503, _REFUSAL, *_HEADERS)
            if not refused:
                await send(message)

        return sending


def route_of(scope: Scope) -> str:
    """Return the address of the API that a request is for."""
    return getattr(scope.get("route"), "path", "other")
