"""What finished runs wrote, so that a command that is repeated does not do all again.

The user's cache has a small file for each output of a command: the digest of what described the
run, size and time of the output, and the position at its end. Without it, all is done again.
"""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fpmatch.base.output import atomic_write_bytes
from fpmatch.errors import OutputError
from fpmatch.gallery.batch.unfinished import Position

if TYPE_CHECKING:
    from collections.abc import Mapping


def remember(output: Path, run: Mapping[str, str], end: Position) -> None:
    """Note that a run has written its output, if anything can be written into the cache."""
    with suppress(OSError, OutputError):
        noted = {**_state(output, run), "end": list(end)}
        atomic_write_bytes(_note_of(output), json.dumps(noted).encode())


def finished_before(output: Path, run: Mapping[str, str]) -> Position | None:
    """Return the position at the end of the same run, if its output is there as it was written."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        noted = json.loads(_note_of(output).read_bytes())
        end = Position(*noted.pop("end"))
        if noted == _state(output, run):
            return end
    return None


def _note_of(output: Path) -> Path:
    from platformdirs import user_cache_path  # noqa: PLC0415

    name = hashlib.sha256(bytes(output.resolve())).hexdigest()[:32]
    return Path(user_cache_path("fpmatch"), "finished", f"{name}.json")


def _state(output: Path, run: Mapping[str, str]) -> dict[str, Any]:
    status = output.stat()
    digest = hashlib.sha256(json.dumps(dict(run), sort_keys=True).encode()).hexdigest()
    return {"run": digest, "size": status.st_size, "time": status.st_mtime_ns}
