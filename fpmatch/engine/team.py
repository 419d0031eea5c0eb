"""The workers on one task: who is handed which chunk, and results in order."""

from __future__ import annotations

from collections import deque
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any, Final

from fpmatch.engine.ahead import take_forked
from fpmatch.engine.processes import pack, start_worker

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator

    from fpmatch.engine.processes import Outcome, Task, Worker

CHUNKS_IN_FLIGHT: Final = 4  # a worker: those it holds, and those done that wait to be taken
_CHUNKS_HELD: Final = 2  # by a worker: the one it works on, and the next


class Team:
    """The workers on one task.

    Parameters
    ----------
    size : int
        How many there may be; they are started when there is work for them.
    idle : list of Worker
        Workers without a task; those needed are taken out of it.
    task : Task
        What to do.
    """

    def __init__(self, size: int, idle: list[Worker], task: Task) -> None:
        self._size = size
        self._idle = idle
        self._task = pack(task)
        self._workers: list[Worker] = []
        self._in_flight: deque[int] = deque()  # numbers of chunks, as drawn
        self._done: dict[int, Outcome] = {}

    def results(self, chunks: Iterable[Any]) -> Generator[Any, None, None]:
        """Yield what comes of each chunk, in order.

        Raises
        ------
        EngineError
            If a worker has ended. What a chunk has raised comes through in its turn.
        """
        numbered = enumerate(chunks)
        self._hand_out(numbered)
        while self._in_flight:
            self._collect()
            self._hand_out(numbered)
            if self._in_flight[0] in self._done:
                yield self._done.pop(self._in_flight.popleft()).get()

    def release(self) -> list[Worker]:
        """Let the workers go, which have nothing left to do."""
        workers, self._workers = self._workers, []
        return workers

    def _hand_out(self, numbered: Iterator[tuple[int, Any]]) -> None:
        """Draw chunks, as many as the workers can hold and may wait to be taken."""
        while len(self._in_flight) < CHUNKS_IN_FLIGHT * self._size and self._has_room():
            drawn = next(numbered, None)
            if drawn is None:
                return
            self._in_flight.append(drawn[0])
            self._least_busy().hand(*drawn)

    def _has_room(self) -> bool:
        return len(self._workers) < self._size or any(
            worker.holds < _CHUNKS_HELD for worker in self._workers
        )

    def _least_busy(self) -> Worker:
        """Return a worker for the next chunk: one more, while all have work and there may be."""
        least = min(self._workers, key=lambda worker: worker.holds, default=None)
        if least is not None and (least.holds == 0 or len(self._workers) == self._size):
            return least
        new = self._idle.pop() if self._idle else take_forked() or start_worker()
        self._workers.append(new)
        new.begin(self._task)
        return new

    def _collect(self) -> None:
        """Take what the workers have finished; wait for it where nothing can be yielded."""
        busy: dict[Any, Worker] = {w.pipe: w for w in self._workers if w.holds}
        timeout = 0 if self._in_flight[0] in self._done else None
        for pipe in wait(busy, timeout) if busy else []:
            number, outcome = busy[pipe].take()
            self._done[number] = outcome
