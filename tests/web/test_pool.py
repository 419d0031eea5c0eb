"""The pool: work is done, stopped when nobody waits or it takes too long, and never lost."""

from __future__ import annotations

import os
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("anyio", reason="the extra `web` is not installed")

import anyio
from pool_work import end, modules, refuse, write_late

from fpmatch.errors import ImageError
from fpmatch.web.errors import ClientGoneError, TooLongError, WorkerError
from fpmatch.web.pool import Pool


class Client:
    """A client that hangs up after some seconds, or never."""

    def __init__(self, patience: float = 60.0) -> None:
        self.patience = patience

    async def receive(self) -> dict[str, str]:
        await anyio.sleep(self.patience)
        return {"type": "http.disconnect"}


def run(test: Callable[[], Awaitable[Any]]) -> Any:
    return anyio.run(test)


def test_work_is_done_in_another_process() -> None:
    async def test() -> int:
        return await Pool(1, 30).run(Client(), os.getpid)  # type: ignore[arg-type]

    assert run(test) != os.getpid()


def test_bad_input_comes_through_as_it_is() -> None:
    async def test() -> None:
        await Pool(1, 30).run(Client(), refuse, "print.tif")  # type: ignore[arg-type]

    with pytest.raises(ImageError, match=r"print\.tif: no print"):
        run(test)


def test_work_stops_when_its_client_hangs_up(tmp_path: Path) -> None:
    file = tmp_path / "late"

    async def test() -> int:
        pool = Pool(1, 30)
        await pool.run(Client(), os.getpid)  # type: ignore[arg-type]
        begin = time.monotonic()
        with pytest.raises(ClientGoneError):
            await pool.run(Client(0.1), write_late, str(file))  # type: ignore[arg-type]
        assert time.monotonic() - begin < 0.9
        await anyio.sleep(1.2)
        return await pool.run(Client(), os.getpid)  # type: ignore[arg-type]

    assert run(test)
    assert not file.exists()


def test_work_that_waits_for_its_turn_is_dropped(tmp_path: Path) -> None:
    file = tmp_path / "late"

    async def test() -> None:
        pool = Pool(1, 30)
        async with anyio.create_task_group() as group:
            group.start_soon(pool.run, Client(), time.sleep, 0.5)
            await anyio.sleep(0.1)
            with pytest.raises(ClientGoneError):
                await pool.run(Client(0.1), write_late, str(file))  # type: ignore[arg-type]

    run(test)
    assert not file.exists()


def test_work_that_takes_too_long_is_stopped(tmp_path: Path) -> None:
    file = tmp_path / "late"

    async def test() -> None:
        pool = Pool(1, 30)
        await pool.run(Client(), os.getpid)  # type: ignore[arg-type]
        pool._seconds = 0.2
        with pytest.raises(TooLongError, match=r"longer than 0\.2 seconds"):
            await pool.run(Client(), write_late, str(file))  # type: ignore[arg-type]
        await anyio.sleep(1.0)

    run(test)
    assert not file.exists()


def test_a_process_that_ends_is_replaced() -> None:
    async def test() -> int:
        pool = Pool(1, 30)
        with pytest.raises(WorkerError):
            await pool.run(Client(), end)  # type: ignore[arg-type]
        return await pool.run(Client(), os.getpid)  # type: ignore[arg-type]

    assert run(test)


def test_a_process_that_was_stopped_is_replaced_before_it_is_needed() -> None:
    async def test() -> tuple[set[int], set[int]]:
        pool = Pool(1, 30)
        async with pool.running():
            before = {await pool.run(Client(), os.getpid)}  # type: ignore[arg-type]
            with pytest.raises(ClientGoneError):
                await pool.run(Client(0.1), time.sleep, 60)  # type: ignore[arg-type]
            loaded = await pool.run(Client(), modules)  # type: ignore[arg-type]
            assert "fpmatch.web.pair" in loaded
            return before, {await pool.run(Client(), os.getpid)}  # type: ignore[arg-type]

    before, after = run(test)
    assert not before & after
