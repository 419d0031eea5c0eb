"""Worker processes on this machine, and what is said between them and who started them.

Each worker has a pipe of its own. Down it come a task, the chunks of that task and then, perhaps,
another task; back comes what became of each chunk. A worker is handed one chunk beyond the one it
works on, so that it never waits for the next.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
import traceback
from collections import deque
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import wait
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Final

from fpmatch.engine.threads import single_threaded
from fpmatch.errors import EngineError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator
    from multiprocessing.connection import Connection

    Pipe = Connection[Any, Any]

# A fork server forks each worker from a process that has imported what it needs and run nothing.
START_METHOD: Final = "forkserver" if sys.platform == "linux" else "spawn"
CHUNKS_IN_FLIGHT: Final = 4  # a worker: those it holds, and those done that wait to be taken
_CHUNKS_HELD: Final = 2  # by a worker: the one it works on, and the next
_STOP: Final = b""
_BROKEN: Final = (
    "a worker process ended before its work was done: out of memory, or started by a script "
    'without `if __name__ == "__main__":`; one worker needs neither'
)


@dataclass(frozen=True, slots=True)
class Task:
    """Hold a function, and what it needs for each of its chunks."""

    work: Callable[[Any, Any], Any]
    shared: Any


@dataclass(frozen=True, slots=True)
class _Outcome:
    """Hold what came of a chunk: a result, or an error and where it was raised."""

    result: Any = None
    error: BaseException | None = None
    where: str = ""

    def get(self) -> Any:
        if self.error is None:
            return self.result
        raise self.error from _RaisedInAWorkerError(self.where)


class _RaisedInAWorkerError(Exception):
    """The cause of an error that comes through: its traceback, in words."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


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
        self._task = _packed(task)
        self._workers: list[Worker] = []
        self._in_flight: deque[int] = deque()  # numbers of chunks, as drawn
        self._done: dict[int, _Outcome] = {}

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
        new = self._idle.pop() if self._idle else Worker()
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


class Worker:
    """A process, and this end of its pipe."""

    def __init__(self) -> None:
        context: Any = multiprocessing.get_context(START_METHOD)
        self.pipe, theirs = context.Pipe()
        self._held: deque[int] = deque()
        self._process = context.Process(target=_be_worker, args=(theirs,))
        self._process.start()
        theirs.close()

    @property
    def holds(self) -> int:
        """Chunks it has been handed and not finished."""
        return len(self._held)

    def begin(self, task: bytes) -> None:
        """Hand it a task."""
        with _broken_is_said():
            self.pipe.send_bytes(task)

    def hand(self, number: int, chunk: object) -> None:
        """Hand it a chunk of the task."""
        packed = _packed(chunk)
        self._held.append(number)
        with _broken_is_said():
            self.pipe.send_bytes(packed)

    def take(self) -> tuple[int, _Outcome]:
        """Return the number of the chunk that it has finished, and what came of it."""
        with _broken_is_said():
            packed = self.pipe.recv_bytes()
        return self._held.popleft(), pickle.loads(packed)

    def stop(self) -> None:
        """Let it end, after the chunk that it works on."""
        with suppress(OSError):  # it has ended
            self.pipe.send_bytes(_STOP)

    def join(self) -> None:
        """Wait until it has ended."""
        try:
            with suppress(EOFError, OSError):
                while True:  # what it still says must not fill the pipe
                    self.pipe.recv_bytes()
        finally:
            self.pipe.close()  # without it the worker ends too, whatever has come up here
        self._process.join()


def end(workers: Iterable[Worker]) -> None:
    """End some workers, which drop what they have not begun."""
    ending = list(workers)
    for worker in ending:
        worker.stop()
    for worker in ending:
        worker.join()


@contextmanager
def _broken_is_said() -> Iterator[None]:
    try:
        yield
    except (EOFError, OSError) as error:
        raise EngineError(_BROKEN) from error


def _packed(message: object) -> bytes:
    return pickle.dumps(message, pickle.HIGHEST_PROTOCOL)


def _be_worker(pipe: Pipe) -> None:
    """Work on what comes down a pipe, until told to end."""
    # Ctrl-C reaches the whole process group: a worker falls silent, its parent reports.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    inbox: SimpleQueue[bytes] = SimpleQueue()
    stopped = threading.Event()
    threading.Thread(target=_listen, args=(pipe, inbox, stopped), daemon=True).start()
    task = None
    with single_threaded():
        while (packed := inbox.get()) and not stopped.is_set():
            message = pickle.loads(packed)
            if isinstance(message, Task):
                task = message
            elif task is not None:
                with suppress(OSError):  # nobody is there; the other thread ends this process
                    pipe.send_bytes(_outcome_of(task, message))


def _listen(pipe: Pipe, inbox: SimpleQueue[bytes], stopped: threading.Event) -> None:
    """Receive what comes, so that who sends it never waits for the chunk at hand."""
    try:
        while message := pipe.recv_bytes():
            inbox.put(message)
    except (EOFError, OSError):
        os._exit(1)  # the process that started this one is gone, however it went
    stopped.set()
    inbox.put(_STOP)


def _outcome_of(task: Task, chunk: object) -> bytes:
    """Work on a chunk, and pack what comes of it."""
    try:
        return _packed(_Outcome(task.work(task.shared, chunk)))
    except BaseException as error:  # noqa: BLE001  (what it raises comes through as it is)
        return _packed(_Outcome(error=error, where=traceback.format_exc()))
