"""Workers hold pieces, and the results are the same on every engine."""

from contextlib import closing
from itertools import count, islice

import chunk_work  # spawned workers must find it by this name
import numpy as np
import pytest

from fpmatch.errors import ImageError
from fpmatch.gallery.engine.engine import make_engine
from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.engine.local import CHUNKS_IN_FLIGHT
from fpmatch.gallery.engine.mapped import MIN_BYTES
from fpmatch.gallery.engine.pieces import hold_pieces, map_batches

PIECES = [np.full(MIN_BYTES, k + 1.0) for k in range(5)]
CHUNKS = [(k, b) for b in range(6) for k in range(5)]
EXPECTED = [10 + MIN_BYTES * (k + 1.0) + b for k, b in CHUNKS]


def test_results_come_in_order_and_chunks_are_drawn_as_they_are_needed(engine):
    with hold_pieces(engine, PIECES) as held:
        assert list(held.map(chunk_work.add_piece, 10, iter(CHUNKS))) == EXPECTED
        assert list(held.map(chunk_work.add_piece, 10, [])) == []
        drawn = count()
        chunks = ((k % 5, k) for k in drawn)
        with (
            closing(held.map(chunk_work.add_piece, 0, chunks)) as one,
            closing(held.map(chunk_work.add_piece, 10, CHUNKS)) as other,
        ):
            for k, found in enumerate(islice(one, 7)):
                assert found == MIN_BYTES * (k % 5 + 1.0) + k
                assert next(other) == EXPECTED[k]
        assert next(drawn) <= 8 + 2 * CHUNKS_IN_FLIGHT


def test_batches_come_with_the_results_of_their_tasks(engine):
    """Some have none, of which one is the first and one the last."""
    batches, drawn = [[], [0, 3], [], [], [4], [1, 1, 2], []], []

    def tasks_of(batch):
        drawn.append(batch)
        return ((k, 5) for k in batch)

    with hold_pieces(engine, PIECES) as held:
        results = list(map_batches(held, chunk_work.add_piece, 10, batches, tasks_of))
        assert list(map_batches(held, chunk_work.add_piece, 10, [], tasks_of)) == []
        assert list(map_batches(held, chunk_work.add_piece, 10, [[]], tasks_of)) == [([], [])]
    assert results == [(one, [15 + MIN_BYTES * (k + 1.0) for k in one]) for one in batches]
    assert drawn == [*batches, []]


def test_threads_work_on_pieces_too():
    with Threads(2) as threads, hold_pieces(threads, PIECES) as held:
        assert list(held.map(chunk_work.add_piece, 10, iter(CHUNKS))) == EXPECTED


def test_an_error_of_the_work_comes_through(engine):
    with hold_pieces(engine, PIECES) as held:
        for error in (ImageError("too small"), TimeoutError("too late")):
            with pytest.raises(type(error), match="too"):
                list(held.map(chunk_work.fail_on_piece, error, CHUNKS))


@pytest.mark.slow
def test_what_a_dead_worker_had_is_done_by_another(local_cluster, tmp_path):
    address = local_cluster.scheduler_address
    with make_engine(scheduler=address) as engine, hold_pieces(engine, PIECES) as held:
        found = list(held.map(chunk_work.die_on_piece, tmp_path, CHUNKS))
    assert found == [value - 10 for value in EXPECTED]
    assert (tmp_path / "died").exists()
