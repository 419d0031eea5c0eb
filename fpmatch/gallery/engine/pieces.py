"""Work on pieces of something large, which the workers of an engine hold.

Each worker gets a piece once and keeps it for all chunks that need it: of a cluster, one worker
each piece; on this machine, all processes map the memory of all pieces, and threads share it.
"""

from __future__ import annotations

import pickle
import uuid
from collections import OrderedDict, deque
from contextlib import closing, contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, Generic, Protocol, TypeVar

from fpmatch.gallery.engine.cluster import DaskCluster
from fpmatch.gallery.engine.cluster_pieces import ClusterPieces
from fpmatch.gallery.engine.local import Processes

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

    from fpmatch.gallery.engine.engine import Engine

Piece = TypeVar("Piece")
HeldPiece_co = TypeVar("HeldPiece_co", covariant=True)
Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")
Batch = TypeVar("Batch")

SETS_HELD: Final = 2  # of pieces that a worker process keeps, the latest ones


class Pieces(Protocol, Generic[HeldPiece_co]):
    """Pieces that workers hold."""

    def map(
        self,
        work: Callable[[Shared, HeldPiece_co, Chunk], Result],
        shared: Shared,
        chunks: Iterable[tuple[int, Chunk]],
    ) -> Generator[Result, None, None]:
        """Yield ``work(shared, pieces[k], chunk)`` for each ``(k, chunk)``, in order.

        All else is as of `fpmatch.gallery.engine.engine.Engine.map`.
        """


@contextmanager
def hold_pieces(engine: Engine, pieces: Sequence[Piece]) -> Iterator[Pieces[Piece]]:
    """Let the workers of an engine, which is entered, hold pieces until the block ends.

    Examples
    --------
    >>> from fpmatch.gallery.engine.engine import serial
    >>> with serial() as engine, hold_pieces(engine, [[1, 2], [3]]) as held:
    ...     list(held.map(lambda most, piece, k: min(piece[k], most), 2, [(1, 0), (0, 1), (0, 0)]))
    [2, 2, 1]
    """
    if isinstance(engine, Processes):
        from fpmatch.gallery.engine.mapped import MappedArrays  # noqa: PLC0415  (imports numpy)

        with MappedArrays() as arrays:
            yield _Held(engine, _Mapped(arrays.pack(list(pieces))))
    elif isinstance(engine, DaskCluster):
        with ClusterPieces(engine, pieces) as held:
            yield held
    else:
        yield _Held(engine, pieces)


def map_batches(
    held: Pieces[Piece],
    work: Callable[[Shared, Piece, Chunk], Result],
    shared: Shared,
    batches: Iterable[Batch],
    tasks_of: Callable[[Batch], Iterable[tuple[int, Chunk]]],
) -> Generator[tuple[Batch, list[Result]], None, None]:
    """Yield batches, drawn as they are needed, with the results of their tasks.

    The tasks of a batch are chunks, each with the number of the piece that it needs.
    """
    pending: deque[tuple[Batch, int]] = deque()

    def chunks() -> Iterator[tuple[int, Chunk]]:
        for batch in batches:
            tasks = list(tasks_of(batch))
            pending.append((batch, len(tasks)))
            yield from tasks

    with closing(held.map(work, shared, chunks())) as results:
        for first in results:
            while not pending[0][1]:
                yield pending.popleft()[0], []
            batch, tasks = pending.popleft()
            yield batch, [first, *islice(results, tasks - 1)]
        yield from ((batch, []) for batch, _ in pending)


class _Held(Generic[Piece]):
    """Pieces that each worker has with what its chunks share."""

    def __init__(self, engine: Engine, pieces: Sequence[Piece] | _Mapped[Piece]) -> None:
        self._engine, self._pieces = engine, pieces

    def map(
        self,
        work: Callable[[Shared, Piece, Chunk], Result],
        shared: Shared,
        chunks: Iterable[tuple[int, Chunk]],
    ) -> Generator[Result, None, None]:
        return self._engine.map(_work_on_piece, (work, shared, self._pieces), chunks)


def _work_on_piece(task: tuple[Any, Any, Any], chunk: tuple[int, Any]) -> Any:
    work, shared, pieces = task
    number, content = chunk
    return work(shared, pieces[number], content)


class _Mapped(Generic[Piece]):
    """Pieces that each process of this machine unpacks once; large arrays are mapped."""

    def __init__(self, packed: bytes) -> None:
        self._name, self._packed = uuid.uuid4().hex, packed

    def __getitem__(self, number: int) -> Piece:
        if self._name not in _unpacked:
            _unpacked[self._name] = pickle.loads(self._packed)
            while len(_unpacked) > SETS_HELD:
                _unpacked.popitem(last=False)
        piece: Piece = _unpacked[self._name][number]
        return piece


# The pieces that this worker process has unpacked, by name.
_unpacked: OrderedDict[str, list[Any]] = OrderedDict()
