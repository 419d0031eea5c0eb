"""The server under attack: its process, memory and log."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from research.attacks.requests import SAMPLES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

_PAUSE_S: Final = 0.05


@dataclass(frozen=True)
class Server:
    """The address of a server, its process, and the file of its log."""

    place: tuple[str, int]
    pid: int
    log: Path


class Memory:
    """The largest resident memory of a process, in megabytes, while the context is open."""

    def __init__(self, pid: int) -> None:
        self._pid, self._end = pid, threading.Event()
        self._thread = threading.Thread(target=self._watch)
        self.before = self.most = resident_mb(pid)

    def __enter__(self) -> Memory:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._end.wait(_PAUSE_S):
            self.most = max(self.most, resident_mb(self._pid))


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process and of its threads, not of its workers."""
    pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def enrol_samples(gallery: str) -> None:
    """Make a gallery of the sample prints."""
    prints = map(str, sorted(SAMPLES.glob("10?_[234].tif")))
    command = [sys.executable, "-m", "fpmatch", "enrol", gallery, *prints]
    subprocess.run(command, check=True, capture_output=True)


@contextmanager
def started(words: Sequence[str], log: Path, *, open_files: int = 1024) -> Iterator[Server]:
    """Start a server with a limit of open files; wait until it prints its address."""
    limited = ["bash", "-c", f'ulimit -n {open_files}; exec "$0" "$@"']
    with log.open("wb") as file:
        process = subprocess.Popen(
            [*limited, *words], stdout=subprocess.PIPE, stderr=file, text=True
        )
    try:
        assert process.stdout is not None
        lines = iter(process.stdout.readline, "")
        line = next((line for line in lines if line.startswith("fpmatch serves")), None)
        if line is None:
            raise OSError(f"the server did not start: {log.read_text('utf-8').strip()}")
        _, _, address, *pid = line.split()
        parts = urlsplit(address)
        yield Server(
            (str(parts.hostname), int(parts.port or 80)), int(pid[0]) if pid else process.pid, log
        )
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        time.sleep(_PAUSE_S)
