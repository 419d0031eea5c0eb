#!/usr/bin/env python3
"""Measure what encryption costs, and that it detects every changed byte.

.venv/bin/python research/benchmarks/encryption.py [--prints 20000] [--flips 100000] [--json FILE]
"""

from __future__ import annotations

import hashlib
import io
import statistics
import tempfile
import time
from collections import namedtuple
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import repository  # noqa: F401

from fpmatch.errors import FpmatchError
from fpmatch.gallery.encryption.keys import KeyRing, new_key
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.store.database import DamagedRowError
from fpmatch.gallery.store.tables import PACKED
from fpmatch.lab.synthesis.templates import make_templates
from research.commands import Command, json_file, write_json

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

SEED = 23
BATCH = 500  # entries a transaction
ROUNDS = 5
PROBES = 5
FLIPPED = 50  # prints of the gallery whose bytes are flipped
LIMITS = {"store": 1.2, "open": 1.2, "search": 1.02}
KINDS = ("plain", "encrypted")


def entries(count: int) -> list[NewEntry]:
    """Return entries of synthetic prints of different fingers."""
    return [
        NewEntry(
            Label(str(number)),
            f"{number}.tif",
            hashlib.sha256(str(number).encode()).digest(),
            template,
        )
        for number, template in enumerate(make_templates(SEED, range(count)))
    ]


def times_of(work: dict[str, Callable[[], Any]]) -> dict[str, float]:
    """Return processor seconds of two works, the median of several rounds in turn."""
    taken: dict[str, list[float]] = {kind: [] for kind in work}
    for number in range(ROUNDS):
        for kind in list(work) if number % 2 else list(work)[::-1]:
            start = time.process_time()
            work[kind]()
            taken[kind].append(time.process_time() - start)
    return {kind: statistics.median(found) for kind, found in taken.items()}


def measured(
    folder: Path, ring: KeyRing, prints: Sequence[NewEntry]
) -> dict[str, dict[str, float]]:
    """Return the times to store prints, to open a prepared gallery, and to search it."""
    made = iter(range(10**6))

    def store(kind: str, path: Path) -> None:
        with open_gallery(path, create=True, key=ring, encrypt=kind == "encrypted") as gallery:
            for at in range(0, len(prints), BATCH):
                gallery.add(prints[at : at + BATCH])

    def store_anew(kind: str) -> None:
        store(kind, folder / f"{kind}-{next(made)}.db")

    def opened(kind: str) -> Any:
        with open_gallery(folder / f"{kind}.db", key=ring) as gallery:
            return open_search(gallery, engine=serial())

    for kind in KINDS:
        store(kind, folder / f"{kind}.db")
        opened(kind)
    searches = {kind: opened(kind) for kind in KINDS}
    probes = [entry.template for entry in prints[:PROBES]]
    results = [
        [identify(searches[kind], p, workers=1).candidates for p in probes] for kind in KINDS
    ]
    if results[0] != results[1]:
        raise AssertionError("an encrypted gallery gives other results")

    def search(kind: str) -> None:
        for probe in probes:
            identify(searches[kind], probe, workers=1)

    works = {"store": store_anew, "open": opened, "search": search}
    return {
        name: times_of({kind: partial(work, kind) for kind in KINDS})
        for name, work in works.items()
    }


def targets(
    folder: Path, ring: KeyRing, prints: Sequence[NewEntry]
) -> Iterator[tuple[str, bytes, Any]]:
    """Yield a name, encrypted bytes, and what reads them, or raises an error."""
    path = folder / "flipped.db"
    with open_gallery(path, create=True, key=ring, encrypt=True) as gallery:
        gallery.add(prints[:FLIPPED])
        open_search(gallery, engine=serial())
        sealing = gallery.sealing()
        with gallery.reading() as connection:
            row = connection.execute(PACKED).first()
    assert sealing is not None
    assert row is not None
    stored = namedtuple("Row", row._fields)(*row)
    yield "entry", row.template, lambda data: sealing.unseal_row(stored._replace(template=data))
    (prepared,) = path.with_name(f"{path.name}.prepared").iterdir()
    yield (
        "prepared prints",
        prepared.read_bytes(),
        lambda data: sealing.unsealed_file(io.BytesIO(data)),
    )


def flipped(name: str, data: bytes, read: Callable[[bytes], Any], tries: int) -> dict[str, Any]:
    """Change one byte at a time anywhere, and count how often that is detected."""
    rng = np.random.default_rng(len(data))
    read(data)
    detected = 0
    places = rng.integers(0, len(data), tries).tolist()
    changes = rng.integers(1, 256, tries).tolist()
    for place, change in zip(places, changes, strict=True):
        changed = bytearray(data)
        changed[place] ^= change
        try:
            read(bytes(changed))
        except (FpmatchError, DamagedRowError):
            detected += 1
    return {"of": name, "bytes": len(data), "tries": tries, "detected": detected}


@click.command(cls=Command)
@click.option("--prints", type=click.IntRange(min=PROBES), default=20_000, show_default=True)
@click.option("--flips", type=click.IntRange(min=2), default=100_000, show_default=True)
@json_file
@click.pass_context
def main(context: click.Context, prints: int, flips: int, json_file: Path | None) -> None:
    """Measure an encrypted gallery against a plain one, and flip bytes of encrypted data.

    Printed are processor times to store templates, to open a prepared gallery and to search it, and
    their ratios, each measured in turn. Then one byte at a time is changed in an entry and in a
    file of prepared prints. The exit status is 1 where a ratio is above 1.2 (store and open) or
    1.02 (search), or a change is not detected.
    """
    ring = KeyRing([new_key()])
    made = entries(prints)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        times = measured(folder, ring, made)
        ratios = {name: t["encrypted"] / t["plain"] for name, t in times.items()}
        for name, t in times.items():
            each = ", ".join(f"{kind} {1e6 * t[kind] / prints:.2f}" for kind in KINDS)
            click.echo(f"{name:<8} ratio {ratios[name]:.3f}  (us a print: {each})")
        found = [
            flipped(*target, tries=flips // 2 + (k < flips % 2))
            for k, target in enumerate(targets(folder, ring, made))
        ]
    for one in found:
        click.echo(f"{one['of']} of {one['bytes']} bytes: {one['detected']} of {one['tries']}")
    detected, tries = (sum(one[name] for one in found) for name in ("detected", "tries"))
    click.echo(f"detected {detected} of {tries} changed bytes")
    if json_file:
        document = {"prints": prints, "seconds": times, "ratios": ratios, "flips": found}
        write_json(json_file, document)
    slow = any(ratio > LIMITS[name] for name, ratio in ratios.items())
    context.exit(int(slow or detected < tries))


if __name__ == "__main__":
    main()
