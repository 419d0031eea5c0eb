"""What the workers of an enrolment do: extract templates. They need not know the database."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from fpmatch.gallery.entry import Label
    from fpmatch.gallery.prints import ExtractedPrint, PrintFile

    Extractor = Callable[[PrintFile], ExtractedPrint]


@dataclass(frozen=True, slots=True)
class Job:
    """Hold one picture that is new.

    Parameters
    ----------
    file : PrintFile
        Where it lies.
    label : Label
        What it is to be called.
    content : bytes
        SHA-256 of the file.
    """

    file: PrintFile
    label: Label
    content: bytes


@dataclass(frozen=True, slots=True)
class ExtractedJob:
    """Hold what came of a picture, or the reason why nothing did."""

    job: Job
    extracted: ExtractedPrint | None = None
    reason: str = ""


def extract_jobs(extractor: Extractor, jobs: Sequence[Job]) -> list[ExtractedJob]:
    """Extract the templates of some pictures.

    Parameters
    ----------
    extractor : callable
        Makes the template of a picture.
    jobs : sequence of Job
        The pictures.

    Returns
    -------
    list of ExtractedJob
        One each, in their order.
    """
    return [_extract(extractor, job) for job in jobs]


def _extract(extractor: Extractor, job: Job) -> ExtractedJob:
    try:
        return ExtractedJob(job, extractor(job.file))
    except FpmatchError as error:
        return ExtractedJob(job, reason=str(error))
