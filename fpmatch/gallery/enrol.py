"""Enrol pictures: find out which are new, extract their templates, keep them."""

from __future__ import annotations

import hashlib
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Final

from fpmatch.engine.engine import processes
from fpmatch.engine.workers import Progress, no_progress
from fpmatch.gallery.consistency import refuse_disagreeing
from fpmatch.gallery.duplicates import Claim
from fpmatch.gallery.entry import Failure, NewEntry
from fpmatch.gallery.extraction import ExtractedJob, Job, extract_jobs
from fpmatch.gallery.names import NamePattern, as_text
from fpmatch.gallery.prints import by_note, extract_print, folder_reader
from fpmatch.output import reason

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from fpmatch.engine.engine import Engine
    from fpmatch.gallery.entry import Label
    from fpmatch.gallery.extraction import Extractor
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.prints import PrintFile

IMAGES_PER_CHUNK: Final = 2
IMAGES_PER_COMMIT: Final = 4
IMAGES_PER_LOOK: Final = 32  # of which it is asked at once whether they are enrolled


@dataclass(frozen=True, slots=True)
class Enrolment:
    """Hold what became of some pictures.

    Parameters
    ----------
    enrolled, known : int
        How many are enrolled now, and how many were before.
    failures : tuple of Failure
        The others, and why.
    assumed : tuple of Path
        Pictures enrolled now that do not tell their resolution; 500 dpi was assumed.
    noted : dict of str to tuple of Path
        What was noticed on reading pictures that are enrolled now, and of which.
    """

    enrolled: int
    known: int
    failures: tuple[Failure, ...]
    assumed: tuple[Path, ...]
    noted: dict[str, tuple[Path, ...]] = field(default_factory=dict)


def enrol(
    gallery: Gallery,
    prints: Sequence[PrintFile],
    *,
    pattern: NamePattern | None = None,
    engine: Engine | None = None,
    extractor: Extractor | None = None,
    progress: Progress = no_progress,
    strict: bool = False,
) -> Enrolment:
    """Enrol pictures in a gallery, those that are not in it.

    What is done is committed every few pictures: a run that was killed goes on where it stopped
    when it is started again, and two runs may enrol at once.

    Parameters
    ----------
    gallery : Gallery
        An open gallery.
    prints : sequence of PrintFile
        From `find_prints`.
    pattern : NamePattern, optional
        Reads subject, finger and impression from paths (default: FVC's names).
    engine : Engine, optional
        Where pictures are worked on (default: all cores); its workers must see the files.
    extractor : callable
        Makes the template of a picture (default: `extract_print`, the images of a folder read with
        one polarity); a function at the top of a module.
    progress : callable
        Told of stage "enrol", in pictures.
    strict : bool
        Refuse impressions that do not match the others of their finger, once all are extracted;
        see `fpmatch.gallery.consistency`.

    Returns
    -------
    Enrolment
        What became of them. A picture that cannot be enrolled stops nothing; it is listed there,
        and in the gallery until it can.

    Raises
    ------
    GalleryError
        If the gallery cannot be read or written.
    EngineError
        If the engine broke down.
    """
    make = extractor or partial(extract_print, reader=folder_reader(prints))
    run = _Run(gallery, pattern or NamePattern(), len(prints), progress)
    progress("enrol", 0, len(prints))
    with (
        engine or processes() as place,
        closing(place.map(extract_jobs, make, run.new(prints))) as results,
    ):
        extracted: list[ExtractedJob] = []
        for chunk in results:
            extracted += chunk
            if len(extracted) >= IMAGES_PER_COMMIT:
                run.take(extracted)
                extracted = []
    run.take(extracted)
    if strict:
        refused = refuse_disagreeing(gallery, run.labels)
        run.failures += refused
        run.enrolled -= len(refused)
    failures, assumed = tuple(run.failures), tuple(run.assumed)
    return Enrolment(run.enrolled, run.known, failures, assumed, by_note(run.noted))


@dataclass(slots=True)
class _Run:
    """One run of `enrol`, and how far it has come."""

    gallery: Gallery
    pattern: NamePattern
    total: int
    progress: Progress
    enrolled: int = 0
    known: int = 0
    failures: list[Failure] = field(default_factory=list)
    assumed: list[Path] = field(default_factory=list)
    noted: list[tuple[Path, tuple[str, ...]]] = field(default_factory=list)
    unsaved: list[Failure] = field(default_factory=list)
    labels: list[Label] = field(default_factory=list)

    def new(self, prints: Sequence[PrintFile]) -> Iterator[list[Job]]:
        """Yield the pictures that are not enrolled, in chunks of work."""
        waiting: list[Job] = []
        for k in range(0, len(prints), IMAGES_PER_LOOK):
            waiting += self._wanted(prints[k : k + IMAGES_PER_LOOK])
            while len(waiting) >= IMAGES_PER_CHUNK:
                yield waiting[:IMAGES_PER_CHUNK]
                del waiting[:IMAGES_PER_CHUNK]
        if waiting:
            yield waiting

    def _wanted(self, prints: Sequence[PrintFile]) -> Iterator[Job]:
        """Yield those pictures against which nothing speaks."""
        jobs = []
        for file in prints:
            job = self._read(file)
            if isinstance(job, Failure):
                self.unsaved.append(job)
            else:
                jobs.append(job)
        claims = [Claim(job.label, job.content, job.file.dpi) for job in jobs]
        for job, objection in zip(jobs, self.gallery.find_conflicts(claims), strict=True):
            if objection is None:
                yield job
            elif objection:
                self.unsaved.append(_failure(job.file, objection))
            else:
                self.known += 1
        self._tell()

    def _read(self, file: PrintFile) -> Job | Failure:
        """Return what is to be enrolled of a file, or why it cannot be."""
        label = self.pattern.label(file.path)
        if label is None:
            return _failure(file, f"its name does not fit the pattern {self.pattern.text}")
        try:
            content = hashlib.sha256(file.path.read_bytes()).digest()
        except OSError as error:
            return _failure(file, reason(error))
        return Job(file, label, content)

    def take(self, results: Sequence[ExtractedJob]) -> None:
        """Keep what came of some pictures, and what has failed since."""
        new = []
        for result in results:
            job, extracted = result.job, result.extracted
            if extracted is None:
                self.unsaved.append(_failure(job.file, result.reason))
                continue
            source = as_text(job.file.path.absolute())
            new.append(NewEntry(job.label, source, job.content, extracted.template))
            if extracted.dpi_assumed:
                self.assumed.append(job.file.path)
            if extracted.notes:
                self.noted.append((job.file.path, extracted.notes))
        if new or self.unsaved:
            failures, self.unsaved = self.unsaved, []
            find_conflicts = self.gallery.add(new, failures)
            self.failures += failures
            for entry, objection in zip(new, find_conflicts, strict=True):
                self.enrolled += objection is None
                self.labels += [entry.label] if objection is None else []
                self.known += objection == ""
                if objection:
                    self.failures.append(Failure(entry.source, objection))
        self._tell()

    def _tell(self) -> None:
        done = self.enrolled + self.known + len(self.failures) + len(self.unsaved)
        self.progress("enrol", done, self.total)


def _failure(file: PrintFile, why: str) -> Failure:
    """Return the failure of a file; its path is not said twice."""
    return Failure(as_text(file.path.absolute()), why.removeprefix(f"{file.path}: "))
