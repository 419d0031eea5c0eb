"""Checks of what requests need: in time, without a turn of theirs, once for all who ask."""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import Future
from time import monotonic
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import FpmatchError
from fpmatch.server.errors import NotReadyError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

CHECK_S: Final = 1.5  # that a check may take: whoever asks is answered within two seconds
KEPT_S: Final = 1.0  # that its outcome is told without another check


class Check:
    """Find out whether something works; `what` is its name in the error where it is silent.

    There is one check at a time. While one goes on for too long, there is no other, and whoever
    asks is told so at once.
    """

    def __init__(self, what: str, look: Callable[[], Awaitable[object]]) -> None:
        self._look = look
        why = f"{what} has not answered within {CHECK_S:g} seconds"
        self._silent = NotReadyError(why, code="late")
        self._task: asyncio.Task[FpmatchError | None] | None = None
        self._began = self._ended = 0.0

    async def fault(self) -> FpmatchError | None:
        """Return what is wrong, with code "late" where there is no answer; None if nothing is."""
        task = self._task
        if task is None or (task.done() and monotonic() - self._ended >= KEPT_S):
            self._began = monotonic()
            self._task = task = asyncio.create_task(self._outcome())
        left = self._began + CHECK_S - monotonic()
        done, _ = await asyncio.wait([task], timeout=max(0.0, left))
        return task.result() if done else self._silent

    async def _outcome(self) -> FpmatchError | None:
        try:
            await self._look()
        except FpmatchError as error:
            return error
        finally:
            self._ended = monotonic()
        return None


def in_own_thread(work: Callable[..., object], *args: Any) -> Awaitable[object]:
    """Return what waits for ``work(*args)``, done in a thread that does not keep a program alive.

    Threads of a pool may all be taken, and those that hang would keep the server from its end.
    """
    done: Future[object] = Future()
    done.set_running_or_notify_cancel()

    def run() -> None:
        try:
            done.set_result(work(*args))
        except Exception as error:  # noqa: BLE001  (raised where it is waited for)
            done.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return asyncio.wrap_future(done)
