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
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Final

from fpmatch.engine.threads import single_threaded
from fpmatch.errors import EngineError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from multiprocessing.connection import Connection

    Pipe = Connection[Any, Any]

# A fork server forks each worker from a process that has imported what it needs and run nothing.
START_METHOD: Final = "forkserver" if sys.platform == "linux" else "spawn"
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
class Outcome:
    """Hold what came of a chunk: a result, or an error and its traceback in words."""

    result: Any = None
    error: BaseException | None = None
    where: str = ""

    def get(self) -> Any:
        """Return the result, or raise the error."""
        if self.error is None:
            return self.result
        raise self.error from _RaisedInAWorkerError(self.where)


class _RaisedInAWorkerError(Exception):
    """The cause of an error that comes through: its traceback, in words."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


class Worker:
    """A process, and this end of its pipe."""

    def __init__(self, pipe: Pipe, wait_for_it: Callable[[], None]) -> None:
        self.pipe = pipe
        self._held: deque[int] = deque()
        self._wait_for_it = wait_for_it

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
        packed = pack(chunk)
        self._held.append(number)
        with _broken_is_said():
            self.pipe.send_bytes(packed)

    def take(self) -> tuple[int, Outcome]:
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
        self._wait_for_it()


def start_worker() -> Worker:
    """Start a process that begins afresh, as `fpmatch.engine.engine.cores` has it."""
    context: Any = multiprocessing.get_context(START_METHOD)
    ours, theirs = context.Pipe()
    process = context.Process(target=be_worker, args=(theirs,))
    process.start()
    theirs.close()
    return Worker(ours, process.join)


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


def pack(message: object) -> bytes:
    """Return a message in the form in which it is sent."""
    return pickle.dumps(message, pickle.HIGHEST_PROTOCOL)


def be_worker(pipe: Pipe) -> None:
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
        return pack(Outcome(task.work(task.shared, chunk)))
    except BaseException as error:  # noqa: BLE001  (what it raises comes through as it is)
        return pack(Outcome(error=error, where=traceback.format_exc()))
