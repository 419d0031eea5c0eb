"""The program under attack: commands in processes of their own, and a folder for their files."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from sqlite3 import connect
from typing import TYPE_CHECKING, Any, Final

from research.attacks.requests import PROBE, REFERENCE, SAMPLES
from research.commands import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from random import Random

    Words = tuple[object, ...]

__all__ = ["PROBE", "REFERENCE", "SAMPLES"]  # from the other attacks
KEY: Final = "file:keys.txt"
_OPTIONS: Final = {"plain": (), "audited": ("--audit",), "sealed": ("--encrypt", "--key", KEY)}
_COPIED: Final = (
    "'x', finger, impression, source, x'00', dpi, minutiae, digest, template FROM fpmatch_entry"
)
SQL_CHANGES: Final = (  # of a gallery, by something else than fpmatch
    "DELETE FROM fpmatch_entry WHERE id = 3",
    "DELETE FROM fpmatch_entry",
    "UPDATE fpmatch_entry SET subject = 'x' WHERE id = 3",
    "UPDATE fpmatch_entry SET impression = 'x' WHERE id = 3",
    "UPDATE fpmatch_entry SET template = (SELECT template FROM fpmatch_entry WHERE id = 9)",
    "UPDATE fpmatch_entry SET id = 99 WHERE id = 3",
    f"INSERT INTO fpmatch_entry SELECT 99, {_COPIED} WHERE id = 3",
    f"INSERT INTO fpmatch_entry SELECT -1, {_COPIED} WHERE id = 3",
)


@dataclass(frozen=True)
class Run:
    """A command that has ended; its status is 124 where it took too long."""

    words: tuple[str, ...]
    status: int
    out: str
    err: str

    @property
    def refused(self) -> bool | str:
        """Whether it was refused in one line with exit status 2; else what it did."""
        lines = [line for line in self.err.splitlines() if not line.startswith("fpmatch: note:")]
        usage = bool(lines) and lines[0].startswith("Usage: ")
        errors = [line for line in lines if line and not line.startswith(("Usage: ", "Try "))]
        start = "Error: " if usage else "fpmatch: error: "
        return ((self.status, len(errors)) == (2, 1) and errors[0].startswith(start)) or str(self)

    @property
    def read_or_refused(self) -> bool | str:
        """Whether it ended with a result or at most one error; else what it did."""
        errors = [line for line in self.err.splitlines() if "error:" in line]
        return ("Traceback" not in self.err and len(errors) < 2 and self.status < 4) or str(self)

    @property
    def kept(self) -> bool | str:
        """Whether its exit status is 0; else what it did."""
        return self.status == 0 or str(self)

    def __str__(self) -> str:
        return f"{' '.join(self.words)}: status {self.status}: {self.err.strip()[-200:]}"


@dataclass(frozen=True)
class Place:
    """The folder of an attack, its random numbers, and the folder of galleries to copy."""

    folder: Path
    random: Random
    common: Path

    def start(
        self,
        *words: object,
        program: Sequence[object] = ("-m", "fpmatch"),
        before: Sequence[str] = (),
        env: Mapping[str, str] | None = None,
        umask: int = -1,
    ) -> subprocess.Popen[bytes]:
        """Start a command in this folder, in a process group and an environment of its own."""
        base = {"PATH": os.environ["PATH"], "LC_ALL": "C.UTF-8", "PYTHONPATH": str(ROOT)}
        base |= {"HOME": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1"}
        base |= {"FPMATCH_KEY": KEY} if (self.folder / "keys.txt").exists() else {}
        return subprocess.Popen(
            [*before, sys.executable, *(_word(word) for word in (*program, *words))],
            cwd=self.folder,
            env={**base, **(env or {})},
            umask=umask,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )

    def run(self, *words: object, timeout_s: float = 60, **options: Any) -> Run:
        """Run a command."""
        process = self.start(*words, **options)
        try:
            out, err = process.communicate(timeout=timeout_s)
            status = process.returncode
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            (out, err), status = process.communicate(), 124
        texts = (text.decode(errors="surrogateescape") for text in (out, err))
        return Run(tuple(map(str, words)), status, *texts)

    def done(self, *words: object, **options: Any) -> Run:
        """Run a command without which an attack cannot begin."""
        run = self.run(*words, **options)
        if run.status:
            raise OSError(str(run))
        return run

    def seconds(self, *words: object) -> float:
        """Return how long a command takes."""
        start = time.monotonic()
        self.done(*words)
        return time.monotonic() - start

    def kill(self, seconds: float, *words: object) -> None:
        """Kill a command that takes so long, and its workers, at a random moment of its work."""
        process = self.start(*words)
        time.sleep(self.random.uniform(0.3, 1.0) * seconds)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()

    def write(self, name: str, content: bytes | str) -> Path:
        """Write a file here, which only its owner may read."""
        path = self.folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        path.chmod(0o600)
        return path

    def gallery(self, name: str = "plain.db", kind: str = "plain") -> Path:
        """Copy a gallery of the sample prints here with its key: plain, sealed or audited."""
        source, path = self.common / f"{kind}.db", self.folder / name
        if not source.exists():
            there = Place(self.common, self.random, self.common)
            if not (self.common / "keys.txt").exists():
                there.done("key", "keys.txt", "--new")
            there.done("enrol", source, SAMPLES, *_OPTIONS[kind])
            there.done("identify", source, PROBE)
        for old in self.folder.glob(f"{name}*"):
            shutil.rmtree(old) if old.is_dir() else old.unlink()
        shutil.copy(self.common / "keys.txt", self.folder)
        shutil.copytree(f"{source}.prepared", f"{path}.prepared")
        return Path(shutil.copy(source, path))

    def search(self, gallery: Path, probe: Path = PROBE) -> tuple[dict[str, Any], Run]:
        """Return what `identify --json` prints, but for times and the gallery, and the run."""
        run = self.run("identify", gallery, probe, "--json", "--all")
        result = json.loads(run.out) if run.status == 0 else {"probes": []}
        for one in result["probes"]:
            one["seconds"] = None
        return {**result, "gallery": ""}, run

    def prepared(self, gallery: Path) -> Path:
        """Return the file of prepared prints of a gallery."""
        return next(Path(f"{gallery}.prepared").iterdir())


def _word(word: object) -> Any:
    return word if isinstance(word, bytes | os.PathLike) else str(word)


def flipped(content: bytes, place: int, bit: int = 1) -> bytes:
    """Return a content with one other bit."""
    return content[:place] + bytes([content[place] ^ bit]) + content[place + 1 :]


@contextmanager
def database(path: Path) -> Iterator[Any]:
    """Open a gallery as any program can that knows SQLite."""
    with closing(connect(path)) as opened, opened:
        yield opened


def sound(path: Path) -> bool:
    """Return whether the pages of a gallery are in order."""
    with database(path) as opened:
        return bool(opened.execute("PRAGMA integrity_check").fetchone() == ("ok",))


def templates(path: Path) -> dict[int, bytes]:
    """Return the stored templates by their numbers."""
    with database(path) as opened:
        return dict(opened.execute("SELECT id, template FROM fpmatch_entry"))


def traces(secrets: Iterable[bytes], folder: Path, length: int) -> int:
    """Return how many runs of so many bytes of secrets are in the files of a folder."""
    content = b"\0".join(path.read_bytes() for path in folder.rglob("*") if path.is_file())
    pieces = {content[k : k + length] for k in range(len(content) - length + 1)}
    runs = (one[k : k + length] for one in secrets for k in range(len(one) - length + 1))
    return sum(run in pieces for run in runs if len(set(run)) > 4)  # zeros are no secret
