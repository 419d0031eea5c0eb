"""Galleries of synthetic templates, made without images: for measuring searches and servers."""

from __future__ import annotations

import hashlib
import json
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

from fpmatch.errors import DatasetError
from fpmatch.gallery.engine.engine import processes
from fpmatch.gallery.engine.workers import attempt_each, no_progress
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import EnrolmentRequest, Failure, Label, NewEntry
from fpmatch.gallery.store.rows import pack_entry
from fpmatch.gallery.store.tables import ENROLLED
from fpmatch.lab.synthesis.database import FIRST_FINGER, finger_numbers
from fpmatch.lab.synthesis.plan import DEFAULT_SENSOR, Plan, sensors_named
from fpmatch.lab.synthesis.templates import make_templates

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import PackedEntry
    from fpmatch.lab.synthesis.sensor import Sensor

STAGE: Final = "synth"
TEMPLATES_AT_ONCE: Final = 1024  # that a worker makes, and that are committed


@dataclass(frozen=True, slots=True)
class GalleryMade:
    """The result of `make_gallery`."""

    gallery: str
    fingers: int  # requested ones, all enrolled
    impressions: int  # of each
    made: int  # templates that this call enrolled


def make_gallery(
    where: str | os.PathLike[str],
    *,
    fingers: int,
    impressions: int,
    preset: str = "normal",
    seed: int = 0,
    sensors: Sequence[str | Sensor] = (DEFAULT_SENSOR,),
    first_finger: int = FIRST_FINGER,
    workers: int | None = None,
    progress: Progress = no_progress,
) -> GalleryMade:
    """Enrol synthetic fingers in a gallery, as templates that are made without images.

    Subjects are numbered as the fingers of `fpmatch.lab.synthesis.database.make_database`. The same
    arguments give the same templates, however often interrupted; what is enrolled is not made
    again, and more fingers or impressions may be added. `where`: the gallery, a file or the URL of
    a PostgreSQL database; it is made where it is missing. `fingers`, `impressions`: how many
    fingers, and how many impressions of each. `preset`, `seed`, `sensors`: as for
    `fpmatch.lab.synthesis.templates.make_templates`. `first_finger`: number of the first finger.
    `workers`: processes to use (default: one a core). `progress`: called with stage "synth" and
    numbers of fingers. Raises a `DatasetError` if a number is out of its range, there is no such
    sensor, or the gallery has another print under one of the labels; an `ImageError` if there is no
    such preset; a `GalleryError` if the gallery cannot be read or written.

    Examples
    --------
    >>> import tempfile
    >>> from fpmatch.lab.evaluation.synthetic_gallery import make_gallery
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     make_gallery(f"{folder}/made.db", fingers=3, impressions=2, workers=1).made
    6
    """
    numbers = finger_numbers(first_finger, fingers)
    plan = Plan(seed, preset, sensors_named(sensors), impressions)
    size = max(1, TEMPLATES_AT_ONCE // impressions)
    parts = [numbers[k : k + size] for k in range(0, fingers, size)]
    made, done = 0, 0
    with open_gallery(where, create=True) as gallery:
        gallery.check_keys()
        progress(STAGE, 0, fingers)
        engine = processes(min(workers, len(parts)) if workers else workers)
        attempts = attempt_each(engine, partial(_packed, plan), _missing(gallery, plan, parts))
        with engine, closing(attempts):
            for (part, _), attempt in attempts:
                if attempt.result is None:
                    raise DatasetError(attempt.reason)
                if attempt.result:
                    conflicts = gallery.add_packed(attempt.result)
                    made += sum(conflict is None for conflict in conflicts)
                done += len(part)
                progress(STAGE, done, fingers)
    return GalleryMade(gallery.name, fingers, impressions, made)


def _missing(
    gallery: Gallery, plan: Plan, parts: Sequence[range]
) -> Iterator[tuple[range, frozenset[int]]]:
    """Yield parts of the fingers, and which of their templates are enrolled."""
    for part in parts:
        requests = [EnrolmentRequest(label, content) for label, content in _prints(plan, part)]
        conflicts = gallery.find_conflicts(requests)
        wrong = next((one for one in conflicts if one not in {None, ENROLLED}), None)
        if wrong is not None:
            raise DatasetError(f"{gallery.name}: {wrong}")
        known = frozenset(k for k, conflict in enumerate(conflicts) if conflict == ENROLLED)
        yield part, known


def _prints(plan: Plan, part: range) -> Iterator[tuple[Label, bytes]]:
    """Yield the label of each template of some fingers, and a digest of what it is made from."""
    numbers = range(1, plan.impressions + 1)
    table = {key: value for key, value in plan.table().items() if key != "impressions"}
    origin = {m: table | {"sensors": plan.sensor_of(m).name} for m in numbers}
    digest = {m: hashlib.sha256(json.dumps(origin[m]).encode()) for m in numbers}
    for finger in part:
        for m in numbers:
            content = digest[m].copy()
            content.update(f"{finger}_{m}".encode())
            yield Label(str(finger), impression=str(m)), content.digest()


def _packed(plan: Plan, missing: tuple[range, frozenset[int]]) -> list[PackedEntry | Failure]:
    """Make the templates of some fingers that are not enrolled, packed."""
    part, known = missing
    if len(known) == len(part) * plan.impressions:
        return []
    templates = make_templates(
        plan.seed, part, plan.impressions, preset=plan.preset, sensors=plan.sensors
    )
    source = f"synthetic, {plan.ranges.name}, seed {plan.seed}"
    return [
        pack_entry(NewEntry(label, f"{source}, {label}", content, template))
        for k, ((label, content), template) in enumerate(
            zip(_prints(plan, part), templates, strict=True)
        )
        if k not in known
    ]
