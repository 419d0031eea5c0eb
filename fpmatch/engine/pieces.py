"""Work on pieces of something large, which the workers of an engine hold.

Each worker gets a piece once and keeps it for all chunks that need it: of a cluster, one worker
each piece; on this machine, all processes map the memory of all pieces.
"""

from __future__ import annotations

import pickle
import uuid
from collections import OrderedDict
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, Generic, Protocol, TypeVar

from fpmatch.engine.cluster import DaskCluster
from fpmatch.engine.cluster_pieces import ClusterPieces
from fpmatch.engine.local import Processes

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

    from fpmatch.engine.engine import Engine

Piece = TypeVar("Piece")
HeldPiece_co = TypeVar("HeldPiece_co", covariant=True)
Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")

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

        All else is as of `fpmatch.engine.engine.Engine.map`.
        """


@contextmanager
def hold_pieces(engine: Engine, pieces: Sequence[Piece]) -> Iterator[Pieces[Piece]]:
    """Let the workers of an engine, which is entered, hold pieces until the block ends.

    Examples
    --------
    >>> from fpmatch.engine.engine import serial
    >>> with serial() as engine, hold_pieces(engine, [[1, 2], [3]]) as held:
    ...     list(held.map(lambda most, piece, k: min(piece[k], most), 2, [(1, 0), (0, 1), (0, 0)]))
    [2, 2, 1]
    """
    if isinstance(engine, Processes):
        from fpmatch.engine.mapped import MappedArrays  # noqa: PLC0415  (imports numpy)

        with MappedArrays() as arrays:
            yield _Mapped(engine, arrays.pack(list(pieces)))
    elif isinstance(engine, DaskCluster):
        with ClusterPieces(engine, pieces) as held:
            yield held
    else:
        yield _Own(engine, pieces)


class _Own(Generic[Piece]):
    """Pieces of the process that works on them."""

    def __init__(self, engine: Engine, pieces: Sequence[Piece]) -> None:
        self._engine, self._pieces = engine, pieces

    def map(
        self,
        work: Callable[[Shared, Piece, Chunk], Result],
        shared: Shared,
        chunks: Iterable[tuple[int, Chunk]],
    ) -> Generator[Result, None, None]:
        return self._engine.map(_work_on_own, (work, shared, self._pieces), chunks)


class _Mapped(Generic[Piece]):
    """Pieces that each process of this machine unpacks once; large arrays are mapped."""

    def __init__(self, engine: Engine, packed: bytes) -> None:
        self._engine, self._packed = engine, packed
        self._name = uuid.uuid4().hex

    def map(
        self,
        work: Callable[[Shared, Piece, Chunk], Result],
        shared: Shared,
        chunks: Iterable[tuple[int, Chunk]],
    ) -> Generator[Result, None, None]:
        return self._engine.map(_work_on_mapped, (work, shared, self._name, self._packed), chunks)


def _work_on_own(task: tuple[Any, Any, Sequence[Any]], chunk: tuple[int, Any]) -> Any:
    work, shared, pieces = task
    number, content = chunk
    return work(shared, pieces[number], content)


# The pieces that this worker process has unpacked, by name.
_unpacked: OrderedDict[str, list[Any]] = OrderedDict()


def _work_on_mapped(task: tuple[Any, Any, str, bytes], chunk: tuple[int, Any]) -> Any:
    work, shared, name, packed = task
    if name not in _unpacked:
        _unpacked[name] = pickle.loads(packed)
        while len(_unpacked) > SETS_HELD:
            _unpacked.popitem(last=False)
    number, content = chunk
    return work(shared, _unpacked[name][number], content)
