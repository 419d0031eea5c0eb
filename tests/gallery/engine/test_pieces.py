"""Workers hold pieces, and the results are the same on every engine."""

import os
import pickle
import sys
from contextlib import closing
from itertools import count, islice

import chunk_work  # spawned workers must find it by this name
import numpy as np
import pytest

from fpmatch.errors import EngineError, ImageError
from fpmatch.gallery.engine import cluster_pieces
from fpmatch.gallery.engine.engine import make_engine, processes, serial
from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.engine.local import CHUNKS_IN_FLIGHT
from fpmatch.gallery.engine.mapped import MIN_BYTES, MappedArrays
from fpmatch.gallery.engine.pieces import hold_pieces, map_batches

PIECES = [np.full(MIN_BYTES, k + 1.0) for k in range(5)]
CHUNKS = [(k, b) for b in range(6) for k in range(5)]
EXPECTED = [10 + MIN_BYTES * (k + 1.0) + b for k, b in CHUNKS]
ON_LINUX = pytest.mark.skipif(sys.platform != "linux", reason="memory is shared on Linux")


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


@ON_LINUX
def test_processes_map_the_memory_of_pieces(tmp_path):
    np.save(tmp_path / "file.npy", np.arange(MIN_BYTES, dtype=np.float64))
    content = np.memmap(tmp_path / "file.npy", np.uint8, "r")
    in_file = content[-8 * MIN_BYTES :].view(np.ndarray).view(np.float64)
    whole = np.arange(2.0 * MIN_BYTES)
    given = [in_file, in_file[7:], whole[:MIN_BYTES], whole[MIN_BYTES:], np.arange(3.0)]
    with MappedArrays() as arrays:
        packed = arrays.pack(given)
        (tmp_path / "file.npy").unlink()  # another state of a gallery replaces its file
        assert len(packed) < 2000
        assert all(map(np.array_equal, pickle.loads(packed), given))
    with processes(2) as engine, hold_pieces(engine, given) as held:
        assert list(held.map(chunk_work.add_piece, 0, [(k, 0) for k in range(5)])) == [
            float(one.sum()) for one in given
        ]
        seen = set(held.map(chunk_work.address, None, [(k % 4, k) for k in range(20)]))
    assert {writeable for _, writeable in seen} == {False}


@ON_LINUX
def test_small_arrays_are_mapped_where_they_are_in_a_file(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(bytes(range(256)) * 1000)
    content = np.memmap(path, np.uint8, "r").view(np.ndarray)
    given = [content[k : k + 5000] for k in range(0, 250_000, 5000)]
    with MappedArrays() as arrays:
        packed = arrays.pack(given)
        assert len(packed) < 250_000 / 10
        assert all(map(np.array_equal, pickle.loads(packed), given))
        assert len(arrays.pack(list(map(np.array, given)))) > 250_000


@ON_LINUX
def test_more_files_than_usual_are_held_open(tmp_path):
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    if limits[1] < 600:
        pytest.skip("the system permits few open files")
    given = []
    for k in range(300):
        path = tmp_path / str(k)
        path.write_bytes(bytes([k % 256]) * 2000)
        given.append(np.memmap(path, np.uint8, "r").view(np.ndarray))
    resource.setrlimit(resource.RLIMIT_NOFILE, (256, limits[1]))
    try:
        with MappedArrays() as arrays:
            assert all(map(np.array_equal, pickle.loads(arrays.pack(given)), given))
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)


@ON_LINUX
def test_a_file_that_has_been_replaced_is_not_mapped_in_place_of_the_other(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(bytes(MIN_BYTES))
    mapped = np.memmap(path, np.uint8, "r")
    path.unlink()
    path.write_bytes(bytes([1]) * MIN_BYTES)
    with MappedArrays() as arrays:
        assert not pickle.loads(arrays.pack(mapped.view(np.ndarray))).any()


@ON_LINUX
def test_nothing_is_mapped_after_the_end():
    with MappedArrays() as arrays:
        packed = arrays.pack(np.zeros(MIN_BYTES + 1))
    with pytest.raises(EngineError, match="mapped file"):
        pickle.loads(packed)


def test_where_memory_cannot_be_shared_it_is_copied(monkeypatch):
    monkeypatch.delattr(os, "memfd_create", raising=False)
    with processes(2) as engine, hold_pieces(engine, PIECES) as held:
        assert list(held.map(chunk_work.add_piece, 10, CHUNKS)) == EXPECTED


def test_what_cannot_be_sent_is_one_line():
    with (
        pytest.raises(EngineError, match="one worker needs none"),
        processes(2) as engine,
        hold_pieces(engine, [lambda: 1]),
    ):
        pass
    with serial() as engine, hold_pieces(engine, [lambda: 1]) as held:
        assert list(held.map(lambda a, piece, b: a + piece() + b, 1, [(0, 3)])) == [5]


@pytest.mark.slow
def test_what_a_dead_worker_had_is_done_by_another(local_cluster, tmp_path):
    address = local_cluster.scheduler_address
    with make_engine(scheduler=address) as engine, hold_pieces(engine, PIECES) as held:
        found = list(held.map(chunk_work.die_on_piece, tmp_path, CHUNKS))
    assert found == [value - 10 for value in EXPECTED]
    assert (tmp_path / "died").exists()


@pytest.mark.slow
def test_a_chunk_that_ends_every_worker_is_given_up(local_cluster, monkeypatch):
    monkeypatch.setattr(cluster_pieces, "MOST_LOSSES", 0)
    address = local_cluster.scheduler_address
    with (
        make_engine(scheduler=address) as engine,
        hold_pieces(engine, PIECES) as held,
        pytest.raises(EngineError, match="ended several"),
    ):
        list(held.map(chunk_work.die_always, None, CHUNKS[:1]))


@pytest.mark.slow
def test_a_worker_that_joins_gets_pieces(local_cluster):
    address = local_cluster.scheduler_address
    with make_engine(scheduler=address) as engine, hold_pieces(engine, PIECES) as held:
        before = {pid for pid, _ in held.map(chunk_work.address, None, CHUNKS)}
        local_cluster.scale(3)
        local_cluster.sync(local_cluster._correct_state)
        engine.workers(now=True)
        found = (pid for _ in range(100) for pid, _ in held.map(chunk_work.address, 0, CHUNKS))
        assert len(before) == 2
        assert any(pid not in before for pid in found)


@pytest.mark.slow
def test_a_scheduler_that_is_lost_is_one_line(other_cluster, killed_after_a_result, capfd):
    address, process = other_cluster()
    with make_engine(scheduler=address) as engine, hold_pieces(engine, PIECES) as held:
        results = held.map(chunk_work.address, None, ((k % 5, k) for k in count()))
        refusal = killed_after_a_result(process, results)
    assert refusal == f"{address}: the connection to the scheduler is lost"
    assert capfd.readouterr().err == ""
