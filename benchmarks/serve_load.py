#!/usr/bin/env python3
"""Send one server many requests at once: are the answers right, and is its memory freed.

    .venv/bin/python benchmarks/serve_load.py [--clients 20] [--requests 200] [--workers 2]

Starts `fpmatch serve`, requests every pair of some sample prints once, then lets clients request
them at random, all at once, two fifths with a broken file. Reported are seconds of a single answer
and of all, refusals (503) and repeated requests, answers that differ from those to single requests,
and the memory of server and workers (proportional set size, Linux only) before and after.
"""

from __future__ import annotations

import argparse
import random
import statistics
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

SAMPLES = Path(__file__).resolve().parent.parent / "sample_data"
PRINTS = ("101_1.tif", "101_3.tif", "102_1.tif", "103_2.tif")
BROKEN = "README.md"
SETTLE_S = 3.0


@dataclass(frozen=True)
class Answer:
    """Hold one answer: its status and content, how often it was refused first, and its time."""

    status: int
    content: Any
    refusals: int
    seconds: float


def ask(client: httpx.Client, pair: tuple[str, str]) -> Answer:
    """Ask for one pair until it is answered."""
    start = time.perf_counter()
    refusals = 0
    while True:
        files = {
            role: (name, (SAMPLES / name).read_bytes())
            for role, name in zip(("probe", "reference"), pair, strict=True)
        }
        answer = client.post("/verify", files=files)
        if answer.status_code != 503:
            seconds = time.perf_counter() - start
            return Answer(answer.status_code, answer.json(), refusals, seconds)
        refusals += 1
        time.sleep(float(answer.headers["retry-after"]))


def memory_mb(pid: int) -> float:
    """Return the memory of a process and of those that it has started, in megabytes."""
    own = 0
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines():
        if line.startswith("Pss:"):
            own = int(line.split()[1])
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    return own / 1000 + sum(memory_mb(int(child)) for child in children)


def measure(address: str, pid: int, clients: int, requests: int) -> bool:
    """Print the figures; return whether every answer was right."""
    names = [*PRINTS, BROKEN]
    pairs = [(a, b) for a in names for b in names if a != b]
    with httpx.Client(base_url=address, timeout=300, trust_env=False) as client:
        alone = {pair: ask(client, pair) for pair in pairs}
        usual = [answer.seconds for answer in alone.values() if answer.status == 200]
        print(f"alone: {statistics.median(usual):.3f} s an answer, {len(pairs)} pairs")
        with ThreadPoolExecutor(clients) as people:  # so that every worker has done everything
            list(people.map(lambda pair: ask(client, pair), 2 * pairs))
        time.sleep(SETTLE_S)
        before = memory_mb(pid)
        asked = random.Random(1).choices(pairs, k=requests)
        start = time.perf_counter()
        with ThreadPoolExecutor(clients) as people:
            answers = list(people.map(lambda pair: ask(client, pair), asked))
        seconds = time.perf_counter() - start
        time.sleep(SETTLE_S)
        after = memory_mb(pid)
    wrong = sum(
        (answer.status, answer.content) != (alone[pair].status, alone[pair].content)
        for pair, answer in zip(asked, answers, strict=True)
    )
    slowest = max(answer.seconds for answer in answers)
    refusals = sum(answer.refusals for answer in answers)
    print(f"{requests} requests of {clients} clients: {seconds:.1f} s, slowest {slowest:.1f} s")
    print(f"refused and asked again: {refusals}; answers that differ: {wrong}")
    print(f"memory: {before:.0f} MB before, {after:.0f} MB after")
    return wrong == 0


def main() -> int:
    """Start a server, measure it, stop it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clients", type=int, default=20)
    parser.add_argument("--requests", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    command = [sys.executable, "-m", "fpmatch", "serve", "--port", "0"]
    command += ["--workers", str(options.workers)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = server.stdout.readline().split()[-1]
            right = measure(address, server.pid, options.clients, options.requests)
        finally:
            server.terminate()
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
