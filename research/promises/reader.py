"""Read files in a process of its own, and write a line of JSON for each: what became of it.

Run as ``python -m research.promises.reader image|template FILE...``. A hook of the interpreter sees
every file that is opened to be written, every process and every connection.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
import warnings
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import fpmatch

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from research.promises.program import Place

SECONDS: Final = 5.0  # that a reader may take
MEGABYTES: Final = 1000.0
_ACTS: Final = ("subprocess", "os.", "socket", "shutil", "ctypes.dlopen", "sqlite3", "urllib")
_READING: Final = ("os.listdir", "os.scandir", "os.fwalk", "os.walk", "os.getxattr")
_WRITES: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT


def read_files(place: Place, kind: str, files: Sequence[Path]) -> Iterator[dict[str, Any]]:
    """Read files by a process; where it ends within one, the next process goes on after it."""
    rest = list(files)
    while rest:
        run = place.run(kind, *rest, program=("-m", "research.promises.reader"), timeout_s=300)
        lines = run.out.splitlines()
        for line in lines:
            yield json.loads(line)
        rest = rest[len(lines) :]
        if rest:
            yield {"file": str(rest.pop(0)), "kind": "crash", "text": f"status {run.status}"}
        elif not all(line.isprintable() for line in run.err.splitlines()):
            yield {"file": "", "kind": "crash", "text": f"it wrote {run.err[:200]}"}


def judge(one: dict[str, Any]) -> bool | str:
    """Return whether a file was read or refused in a line, and nothing else; else what was done."""
    text, name = one["text"], Path(one["file"]).name
    fast = one.get("seconds", 0) < SECONDS and one.get("grown", 0) < MEGABYTES
    line = one["kind"] == "refused" and text.isprintable() and name in text and len(text) < 1000
    return (fast and not one.get("acts") and (one["kind"] == "read" or line)) or json.dumps(one)


def _read(kind: str, path: Path) -> dict[str, Any]:
    try:
        if kind == "image":
            image = fpmatch.read_image(path)
            digest = sha256(image.pixels.tobytes()).hexdigest()
            return {"kind": "read", "text": digest, "notes": list(image.notes)}
        return {"kind": "read", "text": repr(fpmatch.load_template(path)), "notes": []}
    except fpmatch.FpmatchError as error:
        return {"kind": "refused", "text": str(error)}
    except BaseException as error:  # noqa: BLE001 - it is what is looked for
        return {"kind": type(error).__name__, "text": str(error)}


def _main(kind: str, *files: str) -> None:
    warnings.simplefilter("error")
    good = sorted(Path(__file__).parents[2].glob("sample_data/101_1.*"))
    _read("image", good[0])  # imports are no acts of a file
    acts: list[str] = []

    def hook(event: str, details: tuple[Any, ...]) -> None:
        writes = event == "open" and isinstance(details[2], int) and details[2] & _WRITES
        if writes or (event.startswith(_ACTS) and event not in _READING):
            acts.append(f"{event} {str(details[0])[:80]}")

    sys.addaudithook(hook)
    for file in files:
        acts.clear()
        before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
        result = _read(kind, Path(file))
        seconds = time.perf_counter() - start
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1000
        measured = {"seconds": round(seconds, 2), "grown": round(grown), "acts": list(acts)}
        sys.stdout.write(json.dumps({"file": file, **result, **measured}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    _main(*sys.argv[1:])
