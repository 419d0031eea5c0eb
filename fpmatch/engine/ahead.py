"""Worker processes made before there is work, beside all that a program does until it has some.

A program that has just begun has one thread and has loaded no library that would start others: it
can be forked like the fork server of the standard library, and sooner, since nothing that it has
loaded must be loaded again. One process is forked from it, which imports what workers need and
then is forked itself, once a worker; it waits for their ends.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import traceback
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Pipe
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.engine.processes import Worker, be_worker
from fpmatch.engine.threads import loaded_single_threaded

if TYPE_CHECKING:
    from collections.abc import Sequence
    from multiprocessing.connection import Connection

_THREADS: Final = Path("/proc/self/task")

_forked: list[Worker] = []


def fork_ahead(workers: int, modules: Sequence[str]) -> None:
    """Fork workers, which import some modules, where this process has only one thread.

    Parameters
    ----------
    workers : int
        How many.
    modules : sequence of str
        Names of modules; those that are not there are passed over.
    """
    if sys.platform != "linux" or len(list(_THREADS.iterdir())) > 1:
        return
    pipes = [Pipe() for _ in range(workers)]
    ours, theirs = [pipe for pipe, _ in pipes], [pipe for _, pipe in pipes]
    on_interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as long as it imports
    try:
        process = os.fork()
        if not process:
            _become_workers(ours, theirs, modules)
    finally:
        signal.signal(signal.SIGINT, on_interrupt)
    for pipe in theirs:
        pipe.close()
    family = _Family(process, workers)
    _forked.extend(Worker(pipe, family.note_end) for pipe in ours)


def take_forked() -> Worker | None:
    """Return one of the workers forked ahead, which is then taken; None where none is left."""
    return _forked.pop() if _forked else None


@dataclass(slots=True)
class _Family:
    """Hold the process that workers are forked from, and how many of them have not ended."""

    process: int
    workers: int

    def note_end(self) -> None:
        """Wait, after the last worker's end, for that of the process, which comes at once."""
        self.workers -= 1
        if not self.workers:
            os.waitpid(self.process, 0)


def _become_workers(
    ours: Sequence[Connection[Any, Any]],
    theirs: Sequence[Connection[Any, Any]],
    modules: Sequence[str],
) -> None:
    """Import modules, fork the workers and wait for their ends; never return."""
    try:
        for pipe in ours:  # whose ends tell the workers of the other process's
            pipe.close()
        _import(modules)
        left = list(theirs)
        while left:
            pipe = left.pop()
            if not os.fork():
                for other in left:
                    other.close()
                gc.enable()
                be_worker(pipe)
                os._exit(0)
            pipe.close()
        for _ in theirs:
            os.wait()
    except BaseException:  # noqa: BLE001  (nothing of the program forked must go on here)
        traceback.print_exc()
        os._exit(1)
    os._exit(0)


def _import(modules: Sequence[str]) -> None:
    """Import modules, and keep workers from looking for garbage in them, which would copy them."""
    gc.disable()
    with loaded_single_threaded():
        for name in modules:
            with suppress(ImportError):
                import_module(name)
    gc.freeze()
