"""Work on every image of some databases, on all cores."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

from fpmatch.engine.workers import run_chunks

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from fpmatch.engine.engine import Engine
    from fpmatch.engine.workers import Progress
    from fpmatch.evaluation.dataset import Dataset

    ImageChunk = list[tuple[Path, float | None]]

IMAGES_PER_CHUNK: Final = 2

Shared = TypeVar("Shared")
Result = TypeVar("Result")


def for_each_image(
    datasets: Sequence[Dataset],
    work: Callable[[Shared, ImageChunk], list[Result]],
    shared: Shared,
    *,
    stage: str,
    workers: int | None,
    engine: Engine | None = None,
    progress: Progress,
) -> list[tuple[Result, ...]]:
    """Return what some work finds of every image, a database at a time.

    Parameters
    ----------
    datasets : sequence of Dataset
        The databases.
    work : callable
        A function at the top of a module, called as ``work(shared, images)`` with a few paths and
        resolutions (None: the file's own); it returns a result for each.
    shared : object
        What all of the work needs.
    stage : str
        What `progress` is told that this is.
    workers : int or None
        Processes to use (None: one a core).
    engine : Engine, optional
        As for `run_chunks`.
    progress : callable
        Told how many images are done.

    Returns
    -------
    list of tuple
        For each database, the results of its impressions in their order.
    """
    images = [(i.path, dataset.dpi) for dataset in datasets for i in dataset.impressions]
    chunks = [images[k : k + IMAGES_PER_CHUNK] for k in range(0, len(images), IMAGES_PER_CHUNK)]
    done = 0

    def finished(chunk: ImageChunk) -> None:
        nonlocal done
        done += len(chunk)
        progress(stage, done, len(images))

    progress(stage, 0, len(images))
    results = run_chunks(work, shared, chunks, workers=workers, engine=engine, finished=finished)
    each = iter([result for chunk in results for result in chunk])
    return [tuple(next(each) for _ in dataset.impressions) for dataset in datasets]
