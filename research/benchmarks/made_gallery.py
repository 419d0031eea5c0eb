"""A gallery of different synthetic prints, made in parts that are kept in a folder.

Part k has the first impressions of the fingers from ``k * PART`` on, packed as galleries pack them;
the sensors take the parts in turn. Its segments of an index are kept with its templates, and made
again where their code has changed.

.venv/bin/python research/benchmarks/made_gallery.py FOLDER PRINTS
"""

from __future__ import annotations

import hashlib
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import repository

from fpmatch.errors import FpmatchError
from fpmatch.gallery.index.print_segment import COLUMNS, MOST_PRINTS, PrintSegment
from fpmatch.gallery.store.array_file import Column, read_arrays, write_arrays
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.matchers.unit_circle import MATCHER

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from fpmatch.templates.minutiae import Template

SEED = 22
PART = 65_536  # prints
SYNTHESIS = "1"  # another where `make_templates` gives other templates
# modules that decide what an index holds
CODE_OF_INDEX = (
    *(f"gallery/index/{name}.py" for name in ("terms", "_term_kernel", "embedding", "segment")),
    *(f"gallery/index/prints/{name}.py" for name in ("stored_descriptors", "compact_template")),
)
ROWS = {"start": Column("<i8", ("prints + 1",)), "content": Column("|u1", ("bytes",))}


@dataclass(frozen=True, eq=False)
class Rows:
    """Bytes of many prints one after another: print k starts at ``start[k]``."""

    start: np.ndarray
    content: np.ndarray

    def __len__(self) -> int:
        return len(self.start) - 1

    def __getitem__(self, k: int) -> bytes:
        return bytes(self.content[self.start[k] : self.start[k + 1]])


def as_rows(rows: Sequence[bytes]) -> dict[str, Any]:
    """Return rows in the arrays of `ROWS`."""
    start = np.cumsum([0, *map(len, rows)], dtype=np.int64)
    return {"start": start, "content": np.frombuffer(b"".join(rows), np.uint8)}


def code_of(*places: str) -> dict[str, str]:
    """Return the digest of the sources of some modules and folders of the package."""
    digest = hashlib.sha256()
    for place in places:
        path = repository.ROOT / "fpmatch" / place
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(file.read_bytes())
    return {"code": digest.hexdigest()}


def kept(
    path: Path,
    columns: Mapping[str, Column],
    about: Mapping[str, str],
    make: Callable[[], Mapping[str, Any]],
) -> dict[str, Any]:
    """Return the arrays of a file, mapped; make it where it is missing or of another state."""
    try:
        return read_arrays(path, columns, about)
    except FpmatchError as error:
        if error.code not in {"missing", "other"}:
            raise
    path.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(path, make(), columns, about)
    return read_arrays(path, columns, about)


def sensor_of(part: int) -> str:
    """Return the name of the sensor that takes a part."""
    return list(SENSORS)[part % len(SENSORS)]


def template_rows(folder: Path, part: int) -> Rows:
    """Return the packed templates of a part."""

    def make() -> Mapping[str, Any]:
        numbers = range(part * PART, (part + 1) * PART)
        return as_rows(
            [pack_template(t) for t in make_templates(SEED, numbers, sensors=[sensor_of(part)])]
        )

    about = {"synthesis": SYNTHESIS, "seed": str(SEED), "part": str(part)}
    return Rows(**kept(folder / f"templates-{part:04}.arrays", ROWS, about, make))


def template_of(rows: Rows, k: int) -> Template:
    """Return the template of a print of a part."""
    return unpack_template(rows[k])


def segments_of(folder: Path, part: int) -> list[PrintSegment]:
    """Return a part of the gallery as an index has it, mapped; make it where it is missing."""
    about = code_of(*CODE_OF_INDEX)
    return [_segment_of(folder, part, k, about) for k in range(PART // MOST_PRINTS)]


def _segment_of(folder: Path, part: int, k: int, about: Mapping[str, str]) -> PrintSegment:
    def make() -> Mapping[str, Any]:
        rows, first = template_rows(folder, part), k * MOST_PRINTS
        templates = [template_of(rows, one) for one in range(first, first + MOST_PRINTS)]
        return index_of(templates, part * PART + first).arrays()

    path = folder / f"index-{part:04}-{k}.arrays"
    return PrintSegment.of_arrays(kept(path, COLUMNS, about, make))


def index_of(templates: Sequence[Template], before: int = 0) -> PrintSegment:
    """Return the segment of some templates, each of another finger, numbered after `before`."""
    numbers = range(before + 1, before + len(templates) + 1)
    return PrintSegment.build(
        [(k, k, t, MATCHER.prepare(t)) for k, t in zip(numbers, templates, strict=True)]
    )


def main() -> None:
    """Make a gallery."""
    folder, prints = Path(sys.argv[1]), int(sys.argv[2])
    for part in range(-(-prints // PART)):
        for make in (template_rows, segments_of):
            start = time.process_time()
            make(folder, part)
            each = 1e6 * (time.process_time() - start) / PART
            print(f"part {part}: {make.__name__}, {each:.0f} µs a print", flush=True)


if __name__ == "__main__":
    main()
