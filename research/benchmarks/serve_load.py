#!/usr/bin/env python3
"""Send one server many requests at once: are all answered, are the answers right, is memory freed.

    .venv/bin/python research/benchmarks/serve_load.py [--clients 60] [--requests 120] [--json]

Starts `fpmatch serve`, requests every pair of some sample prints once, then lets clients request
them at random, all at once, two fifths with a broken file. Reported are the requests that were
refused (status 503) although they may wait, answers that differ from those to single requests,
seconds of an answer (median, 95th percentile), and the memory of server and workers (proportional
set size, Linux only) before and after. Exit status 1 if one was refused or wrong.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from fpmatch.server.settings import Limits

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
PRINTS = ("101_1.tif", "101_3.tif", "102_1.tif", "103_2.tif")
BROKEN = "README.md"
SETTLE_S = 3.0
BUSY = 503


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


def measure(address: str, pid: int, options: argparse.Namespace) -> Load:
    """Request pairs one by one, then many at once."""
    names = [*PRINTS, BROKEN]
    pairs = [(a, b) for a in names for b in names if a != b]
    limits = httpx.Limits(max_connections=options.clients)
    with (
        httpx.Client(base_url=address, timeout=300, trust_env=False, limits=limits) as client,
        ThreadPoolExecutor(options.clients) as people,
    ):
        alone = {pair: ask(client, pair) for pair in pairs}
        usual = [answer.seconds for answer in alone.values() if answer.status == 200]
        # so that every worker has done everything
        list(people.map(lambda pair: ask(client, pair), 2 * pairs))
        time.sleep(SETTLE_S)
        before = memory_mb(pid)
        chosen = random.Random(1).choices(pairs, k=options.requests)
        start = time.perf_counter()
        answers = list(people.map(lambda pair: ask(client, pair), chosen))
        seconds = time.perf_counter() - start
        time.sleep(SETTLE_S)
        after = memory_mb(pid)
    refused = sum(answer.status == BUSY for answer in answers)
    differ = sum(
        (answer.status, answer.content) != (alone[pair].status, alone[pair].content)
        for pair, answer in zip(chosen, answers, strict=True)
    )
    p50, p95, slowest = np.percentile([answer.seconds for answer in answers], [50, 95, 100])
    return Load(
        clients=options.clients,
        workers=options.workers,
        wait_s=Limits().wait_seconds,
        requests=options.requests,
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


def as_text(load: Load) -> str:
    """Return the figures, a line each."""
    rows = {
        "clients at once": load.clients,
        "requests": load.requests,
        f"refused within {load.wait_s:g} s": load.refused,
        "wrong answers": load.wrong,
        "alone": f"{load.alone_s:.3f} s",
        "p50, p95, slowest": f"{load.p50_s:.2f} s, {load.p95_s:.2f} s, {load.slowest_s:.2f} s",
        "all": f"{load.total_s:.1f} s, {load.workers} workers",
        "memory before": f"{load.memory_before_mb:.0f} MB",
        "memory after": f"{load.memory_after_mb:.0f} MB",
    }
    return "\n".join(f"{name:<24}{value}" for name, value in rows.items())


def main() -> int:
    """Start a server, measure it, stop it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clients", type=int, default=60)
    parser.add_argument("--requests", type=int, default=120)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    command = [sys.executable, "-m", "fpmatch", "serve", "--port", "0"]
    command += ["--workers", str(options.workers)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = server.stdout.readline().split()[-1]
            load = measure(address, server.pid, options)
        finally:
            server.terminate()
    print(json.dumps(asdict(load), indent=2) if options.json else as_text(load))
    return 1 if load.refused or load.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
