"""Gate: a bounded amount of something, for which requests wait in the order of arrival."""

from __future__ import annotations

from collections import deque

import anyio


class BusyError(Exception):
    """A request has waited too long, or too many wait."""


class Gate:
    """Let requests in while what they take together stays within a bound; others wait.

    A single request is let in however much it takes. Up to `queue` requests wait.
    """

    def __init__(self, most: float, queue: int) -> None:
        self._most, self._most_waiting = most, queue
        self._queue: deque[tuple[float, anyio.Event]] = deque()  # amount, and what ends the wait
        self.taken = 0.0

    @property
    def waiting(self) -> int:
        """Requests that wait."""
        return len(self._queue)

    async def enter(self, amount: float, seconds: float) -> None:
        """Take an amount as soon as there is room; BusyError after so many seconds."""
        if not self._queue and self._has_room(amount):
            self.taken += amount
            return
        if len(self._queue) >= self._most_waiting:
            raise BusyError
        place = (amount, anyio.Event())
        self._queue.append(place)
        try:
            with anyio.move_on_after(seconds):
                await place[1].wait()
        except BaseException:
            self._abandon(place)
            raise
        if not place[1].is_set():
            self._abandon(place)
            raise BusyError

    def leave(self, amount: float) -> None:
        """Give an amount back."""
        self.taken -= amount
        self._admit()

    def _abandon(self, place: tuple[float, anyio.Event]) -> None:
        """Give back what a request holds that ended while it waited."""
        if place[1].is_set():
            self.leave(place[0])
        else:
            self._queue.remove(place)
            self._admit()

    def _has_room(self, amount: float) -> bool:
        return self.taken + amount <= self._most or not self.taken

    def _admit(self) -> None:
        while self._queue and self._has_room(self._queue[0][0]):
            amount, admitted = self._queue.popleft()
            self.taken += amount
            admitted.set()
