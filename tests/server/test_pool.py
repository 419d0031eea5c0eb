"""The pool: work is done, stopped when nobody waits or it takes too long, and never lost."""

import logging
import os
import signal
import time
from contextlib import asynccontextmanager, suppress
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("anyio", reason="the extra `web` is not installed")

import anyio
from pool_work import modules, note, note_and_end, refuse, write_late

from fpmatch.errors import ImageError
from fpmatch.server.errors import ClientGoneError, RequestError
from fpmatch.server.pool import Pool
from fpmatch.server.settings import Limits, Settings


class Client:
    """A client that hangs up after some seconds, or never."""

    def __init__(self, patience=60.0):
        self.patience = patience

    async def receive(self):
        await anyio.sleep(self.patience)
        return {"type": "http.disconnect"}


PATIENT = Client()


@asynccontextmanager
async def pool_of(workers, gallery=None, **limits):
    pool = Pool(Settings(workers=workers, gallery=gallery, limits=Limits(**limits)))
    async with pool.running():
        yield pool


def test_work_is_done_in_another_process_with_its_errors_and_notes(caplog):
    async def test():
        async with pool_of(1) as pool:
            with pytest.raises(ImageError, match=r"print\.tif: no print"):
                await pool.run(PATIENT, refuse, "print.tif")
            await pool.run(PATIENT, note, "the index is kept in memory")
            return await pool.run(PATIENT, os.getpid)

    assert anyio.run(test) != os.getpid()
    assert ("notes", logging.WARNING, "the index is kept in memory") in caplog.record_tuples


@pytest.mark.slow
@pytest.mark.parametrize(
    ("busy", "seconds", "patience", "error"),
    [
        (False, 30, 0.1, ClientGoneError),
        (True, 30, 0.1, ClientGoneError),  # it waits for its turn
        (False, 0.2, 60, RequestError),
    ],
)
def test_work_is_killed_when_nobody_waits_for_it_or_it_takes_too_long(
    tmp_path, busy, seconds, patience, error
):
    file = tmp_path / "late"

    async def test():
        async with pool_of(1, seconds=seconds) as pool, anyio.create_task_group() as group:
            if busy:
                group.start_soon(pool.run, PATIENT, time.sleep, 0.5)
                await anyio.sleep(0.1)
            begin = time.monotonic()
            with pytest.raises(error, match="longer than" if seconds < 1 else None):
                await pool.run(Client(patience), write_late, str(file))
            assert time.monotonic() - begin < 0.9
            await anyio.sleep(1.2)

    anyio.run(test)
    assert not file.exists()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="there is no /proc")
def test_a_process_that_was_killed_while_it_had_no_work_fails_no_request():
    async def test():
        async with pool_of(2) as pool:
            first = await pool.run(PATIENT, os.getpid)
            async with anyio.create_task_group() as group:
                group.start_soon(pool.run, PATIENT, time.sleep, 0.3)
                other = await pool.run(PATIENT, os.getpid)
            for process in {first, other}:
                os.kill(process, signal.SIGKILL)
                wait_for_end(process)
            return {first, other}, [await pool.run(PATIENT, os.getpid) for _ in range(3)]

    before, after = anyio.run(test)
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
        async with pool_of(1) as pool:
            with pytest.raises(RequestError, match="its process ended"):
                await pool.run(PATIENT, note_and_end, str(file))
            before = await pool.run(PATIENT, os.getpid)
            with pytest.raises(ClientGoneError):
                await pool.run(Client(0.1), time.sleep, 60)
            # the one in its place was prepared before it was needed
            assert "fpmatch.server.pair" in await pool.run(PATIENT, modules)
            return before, await pool.run(PATIENT, os.getpid)

    before, after = anyio.run(test)
    assert before != after
    assert file.read_text() == "begun\n"


def test_the_last_process_is_not_for_the_gallery_and_waits_end():
    async def test():
        async with pool_of(1, "g.db", wait_seconds=0.5) as pool, anyio.create_task_group() as group:
            group.start_soon(partial(pool.run, PATIENT, time.sleep, 5, gallery=True))
            await anyio.sleep(0.1)
            with pytest.raises(RequestError, match="too many requests") as caught:
                await pool.run(PATIENT, os.getpid, gallery=True)
            assert caught.value.status == 503
            assert await pool.run(PATIENT, os.getpid)
            group.cancel_scope.cancel()

    anyio.run(test)
