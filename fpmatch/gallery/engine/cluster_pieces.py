"""Pieces of something large in the memory of the workers of a Dask cluster.

Each piece is sent to one worker, when it is needed first, and all chunks that need it go there.
Where that worker is lost, another one gets the piece and the chunks that were not done. A piece
passes through the scheduler and is not kept there.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from fpmatch.gallery.engine.cluster import KILLED, POLL_S, run_chunk
from fpmatch.gallery.engine.local import results_in_order

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Sequence
    from typing import Self

    from fpmatch.gallery.engine.cluster import DaskCluster

MOST_LOSSES: Final = 10  # times that a chunk is sent again


@dataclass(slots=True)
class _Sent:
    """A chunk that a worker has got, as `run_on_piece` takes it."""

    call: tuple[Any, ...]
    number: int
    chunk: Any
    worker: str
    future: Any
    losses: int = 0


class ClusterPieces:
    """Pieces that workers of a cluster hold; see `fpmatch.gallery.engine.pieces.Pieces`."""

    def __init__(self, cluster: DaskCluster, pieces: Sequence[Any]) -> None:
        self._cluster, self._pieces = cluster, pieces
        self._held: dict[int, tuple[str, Any]] = {}  # worker and future of each piece

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._held.clear()  # no future is left: the workers forget the pieces

    def map(
        self, work: Callable[[Any, Any, Any], Any], shared: Any, chunks: Iterable[tuple[int, Any]]
    ) -> Generator[Any, None, None]:
        """Submit chunks, a few for each worker, and yield their results in order."""
        call = self._cluster.start_run(_work_on_piece, (work, shared))
        yield from results_in_order(
            chunks,
            lambda chunk: self._send(_Sent(call, *chunk, "", None)),
            self._result,
            self._cluster.most_in_flight,
            lambda pending: self._cluster.cancel([sent.future for sent in pending]),
        )

    def _send(self, sent: _Sent) -> _Sent:
        """Submit a chunk to the worker that holds its piece."""
        sent.worker, piece = self._worker_of(sent.number)
        # No other worker: it would copy the piece.
        where = {"workers": [sent.worker], "allow_other_workers": False}
        sent.future = self._cluster.submit(run_on_piece, *sent.call, piece, sent.chunk, **where)
        return sent

    def _result(self, sent: _Sent) -> Any:
        """Wait for a result; a chunk whose worker is lost is sent to another one."""
        while True:
            try:
                return self._cluster.result(sent.future)
            except asyncio.CancelledError:
                lost = True
            except TimeoutError:
                if sent.future.status == "error":
                    raise
                lost = False
            if lost or sent.worker not in self._cluster.workers():
                self._lose(sent)

    def _lose(self, sent: _Sent) -> None:
        """Send a chunk again, whose worker, or piece, is lost."""
        sent.losses += 1
        if sent.losses > MOST_LOSSES:
            raise self._cluster.error(KILLED)
        self._cluster.workers(now=True)
        if self._held.get(sent.number, ("",))[0] == sent.worker:
            del self._held[sent.number]
        self._cluster.cancel([sent.future])
        self._send(sent)

    def _worker_of(self, number: int) -> tuple[str, Any]:
        """Return the worker that holds a piece, and its future there; send it where none does.

        Where workers have joined, those that hold more than others give pieces away.
        """
        while True:
            workers = self._cluster.workers()
            held = Counter(worker for worker, _ in self._held.values() if worker in workers)
            if number in self._held:
                worker = self._held[number][0]
                fair = -(-len(self._pieces) // max(1, len(workers)))
                if worker in workers and held[worker] <= fair:
                    return self._held[number]
            if not workers:
                time.sleep(POLL_S)
                continue
            least = min(sorted(workers), key=lambda worker: held[worker])
            with suppress(Exception, asyncio.CancelledError):  # that worker is lost
                self._held[number] = least, self._cluster.scatter(self._pieces[number], least)
                return self._held[number]
            time.sleep(POLL_S)
            self._cluster.workers(now=True)  # raises where the scheduler is lost


def run_on_piece(run: str, task: bytes, piece: object, chunk: object) -> Any:
    """Work on a chunk and a piece on the worker that holds it."""
    return run_chunk(run, task, (piece, chunk))


def _work_on_piece(task: tuple[Any, Any], piece_and_chunk: tuple[Any, Any]) -> Any:
    work, shared = task
    return work(shared, *piece_and_chunk)
