"""The pool: work is done, stopped when nobody waits or it takes too long, and never lost."""

import logging
import os
import signal
import time
from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("anyio", reason="the extra `web` is not installed")

import anyio
from anyio import to_process
from pool_work import end, modules, note, note_and_end, refuse, write_late

from fpmatch.errors import ImageError
from fpmatch.server.errors import ClientGoneError, RequestError
from fpmatch.server.pool import Pool as PoolOfSettings
from fpmatch.server.settings import Limits, Settings


class Client:
    """A client that hangs up after some seconds, or never."""

    def __init__(self, patience=60.0):
        self.patience = patience

    async def receive(self):
        await anyio.sleep(self.patience)
        return {"type": "http.disconnect"}


PATIENT = Client()


def pool_of(workers, seconds, **settings):
    return PoolOfSettings(Settings(workers=workers, limits=Limits(seconds=seconds, **settings)))


def run(test):
    return anyio.run(test)


def test_work_is_done_in_another_process_and_its_errors_come_through():
    async def test():
        pool = pool_of(1, 30)
        with pytest.raises(ImageError, match=r"print\.tif: no print"):
            await pool.run(PATIENT, refuse, "print.tif")
        return await pool.run(PATIENT, os.getpid)

    assert run(test) != os.getpid()


@pytest.mark.slow
def test_work_stops_when_its_client_hangs_up(tmp_path):
    file = tmp_path / "late"

    async def test():
        pool = pool_of(1, 30)
        await pool.run(PATIENT, os.getpid)
        begin = time.monotonic()
        with pytest.raises(ClientGoneError):
            await pool.run(Client(0.1), write_late, str(file))
        assert time.monotonic() - begin < 0.9
        await anyio.sleep(1.2)
        return await pool.run(PATIENT, os.getpid)

    assert run(test)
    assert not file.exists()


def test_work_that_waits_for_its_turn_is_dropped(tmp_path):
    file = tmp_path / "late"

    async def test():
        pool = pool_of(1, 30)
        async with anyio.create_task_group() as group:
            group.start_soon(pool.run, PATIENT, time.sleep, 0.5)
            await anyio.sleep(0.1)
            with pytest.raises(ClientGoneError):
                await pool.run(Client(0.1), write_late, str(file))

    run(test)
    assert not file.exists()


@pytest.mark.slow
def test_work_that_takes_too_long_is_stopped(tmp_path):
    file = tmp_path / "late"

    async def test():
        pool = pool_of(1, 30)
        await pool.run(PATIENT, os.getpid)
        pool._limits = Limits(seconds=0.2)
        with pytest.raises(RequestError, match=r"longer than 0\.2 seconds"):
            await pool.run(PATIENT, write_late, str(file))
        await anyio.sleep(1.0)

    run(test)
    assert not file.exists()


def test_a_process_that_ends_is_replaced():
    async def test():
        pool = pool_of(1, 30)
        with pytest.raises(RequestError, match="its process ended"):
            await pool.run(PATIENT, end)
        return await pool.run(PATIENT, os.getpid)

    assert run(test)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="there is no /proc")
@pytest.mark.parametrize("pause", [0.0, 0.5])
def test_a_process_that_was_killed_while_it_had_no_work_fails_no_request(pause):
    async def test():
        pool = pool_of(2, 30)
        async with pool.running():
            first = await pool.run(PATIENT, os.getpid)
            async with anyio.create_task_group() as group:
                group.start_soon(pool.run, PATIENT, time.sleep, 0.3)
                other = await pool.run(PATIENT, os.getpid)
            for process in {first, other}:
                os.kill(process, signal.SIGKILL)
                wait_for_end(process)
            await anyio.sleep(pause)
            return {first, other}, [await pool.run(PATIENT, os.getpid) for _ in range(3)]

    before, after = run(test)
    assert not before & set(after)


def wait_for_end(process):
    """Wait until a process has ended, though nobody has asked for its exit status yet."""
    state = Path(f"/proc/{process}/stat")
    with suppress(FileNotFoundError, ProcessLookupError):
        while state.read_text().rpartition(")")[2].split()[0] != "Z":
            time.sleep(0.01)


def test_work_that_ends_its_process_is_not_done_again(tmp_path):
    file = tmp_path / "begun"

    async def test():
        pool = pool_of(1, 30)
        async with pool.running():
            with pytest.raises(RequestError, match="its process ended"):
                await pool.run(PATIENT, note_and_end, str(file))
            return await pool.run(PATIENT, os.getpid)

    assert run(test)
    assert file.read_text() == "begun\n"


def test_idle_processes_are_kept(monkeypatch):
    """By itself anyio ends those that had no work for five minutes."""
    moved = [0.0]
    real = to_process.current_time
    monkeypatch.setattr(to_process, "current_time", lambda: real() + moved[0])

    async def test():
        pool = pool_of(3, 30)
        async with pool.running():
            before = {process.pid for process in to_process._process_pool_workers.get()}
            moved[0] = 3600.0
            await pool.run(PATIENT, os.getpid)
            after = {process.pid for process in to_process._process_pool_workers.get()}
            return before, after

    before, after = run(test)
    assert len(before) == 3
    assert before == after


def test_the_last_process_is_not_for_the_gallery_and_waits_end():
    async def test():
        settings = Settings(workers=1, gallery="prints.db", limits=Limits(wait_seconds=0.5))
        pool = PoolOfSettings(settings)
        async with anyio.create_task_group() as group:
            group.start_soon(partial(pool.run, PATIENT, time.sleep, 5, gallery=True))
            await anyio.sleep(0.1)
            with pytest.raises(RequestError, match="too many requests") as caught:
                await pool.run(PATIENT, os.getpid, gallery=True)
            assert caught.value.status == 503
            assert await pool.run(PATIENT, os.getpid)
            group.cancel_scope.cancel()

    run(test)


def test_notes_of_workers_reach_the_log_of_the_server(caplog):
    async def test():
        pool = pool_of(1, 30)
        await pool.run(PATIENT, note, "the index is kept in memory")

    run(test)
    assert ("notes", logging.WARNING, "the index is kept in memory") in caplog.record_tuples


def test_a_process_that_was_stopped_is_replaced_before_it_is_needed():
    async def test():
        pool = pool_of(1, 30)
        async with pool.running():
            before = await pool.run(PATIENT, os.getpid)
            with pytest.raises(ClientGoneError):
                await pool.run(Client(0.1), time.sleep, 60)
            assert "fpmatch.server.pair" in await pool.run(PATIENT, modules)
            return before, await pool.run(PATIENT, os.getpid)

    before, after = run(test)
    assert before != after
