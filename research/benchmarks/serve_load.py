#!/usr/bin/env python3
"""Send one server many requests at once: are all answered, are the answers right, is memory freed.

.venv/bin/python research/benchmarks/serve_load.py [--clients 60] [--requests 120] [--json FILE]
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import httpx
import numpy as np
import repository  # noqa: F401

from fpmatch.server.settings import Limits
from research.attacks.requests import BUSY, SAMPLES
from research.attacks.server import Server, started
from research.commands import Command, json_file, print_and_write
from research.tables.serving import format_serving

PRINTS = ("101_1.tif", "101_3.tif", "102_1.tif", "103_2.tif")
BROKEN = "README.md"
SETTLE_S = 3.0


@dataclass(frozen=True)
class Answer:
    """One answer: its status and content, and its time."""

    status: int
    content: Any
    seconds: float


@dataclass(frozen=True)
class Load:
    """The requests of a run, and their answers."""

    clients: int
    workers: int
    wait_s: float
    requests: int
    refused: int
    wrong: int
    alone_s: float
    p50_s: float
    p95_s: float
    slowest_s: float
    total_s: float
    memory_before_mb: float
    memory_after_mb: float


def ask(client: httpx.Client, pair: tuple[str, str]) -> Answer:
    """Request the comparison of one pair."""
    start = time.perf_counter()
    files = {
        role: (name, (SAMPLES / name).read_bytes())
        for role, name in zip(("probe", "reference"), pair, strict=True)
    }
    answer = client.post("/verify", files=files)
    return Answer(answer.status_code, answer.json(), time.perf_counter() - start)


def memory_mb(pid: int) -> float:
    """Return the memory of a process and of those that it has started, in megabytes."""
    own = 0
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines():
        if line.startswith("Pss:"):
            own = int(line.split()[1])
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    return own / 1000 + sum(memory_mb(int(child)) for child in children)


def measure(server: Server, clients: int, requests: int, workers: int) -> Load:
    """Request pairs one by one, then many at once."""
    names = [*PRINTS, BROKEN]
    pairs = [(a, b) for a in names for b in names if a != b]
    address = "http://{}:{}".format(*server.place)
    limits = httpx.Limits(max_connections=clients)
    with (
        httpx.Client(base_url=address, timeout=300, trust_env=False, limits=limits) as client,
        ThreadPoolExecutor(clients) as people,
    ):
        alone = {pair: ask(client, pair) for pair in pairs}
        usual = [answer.seconds for answer in alone.values() if answer.status == 200]
        # so that every worker has done everything
        list(people.map(lambda pair: ask(client, pair), 2 * pairs))
        time.sleep(SETTLE_S)
        before = memory_mb(server.pid)
        chosen = random.Random(1).choices(pairs, k=requests)
        start = time.perf_counter()
        answers = list(people.map(lambda pair: ask(client, pair), chosen))
        seconds = time.perf_counter() - start
        time.sleep(SETTLE_S)
        after = memory_mb(server.pid)
    refused = sum(answer.status == BUSY for answer in answers)
    differ = sum(
        (answer.status, answer.content) != (alone[pair].status, alone[pair].content)
        for pair, answer in zip(chosen, answers, strict=True)
    )
    p50, p95, slowest = np.percentile([answer.seconds for answer in answers], [50, 95, 100])
    return Load(
        clients=clients,
        workers=workers,
        wait_s=Limits().wait_seconds,
        requests=requests,
        refused=refused,
        wrong=differ - refused,
        alone_s=round(float(np.median(usual)), 3),
        p50_s=round(float(p50), 2),
        p95_s=round(float(p95), 2),
        slowest_s=round(float(slowest), 2),
        total_s=round(seconds, 2),
        memory_before_mb=round(before, 1),
        memory_after_mb=round(after, 1),
    )


@click.command(cls=Command)
@click.option("--clients", default=60, show_default=True)
@click.option("--requests", default=120, show_default=True)
@click.option("--workers", default=2, show_default=True)
@json_file
@click.pass_context
def main(
    context: click.Context, clients: int, requests: int, workers: int, json_file: Path | None
) -> None:
    """Send one server many requests at once, and compare the answers with single ones.

    Starts `fpmatch serve`, requests every pair of some sample prints once, then lets clients
    request them at random, all at once, two fifths with a broken file. Reported are the requests
    that were refused (status 503) although they may wait, answers that differ from those to single
    requests, seconds of an answer, and the memory of server and workers (proportional set size,
    Linux only) before and after. The exit status is 1 if one was refused or wrong.

    --json writes what ``python -m research tables serving --load`` reads.
    """
    words = [sys.executable, "-m", "fpmatch", "serve", "--port", "0", "--workers", str(workers)]
    with tempfile.TemporaryDirectory() as folder, started(words, Path(folder, "log")) as server:
        load = asdict(measure(server, clients, requests, workers))
    print_and_write(format_serving(load), load, json_file)
    context.exit(1 if load["refused"] or load["wrong"] else 0)


if __name__ == "__main__":
    main()
