"""Cores of this process, chunks of work for its threads, and variables of its environment."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterator

Item = TypeVar("Item")


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def chunks_of(items: list[Item], size: int) -> list[list[Item]]:
    """Return lists of `size` items each, of which the last may have fewer.

    Examples
    --------
    >>> chunks_of([1, 2, 3, 4, 5], 2)
    [[1, 2], [3, 4], [5]]
    """
    return [items[k : k + size] for k in range(0, len(items), size)]


@contextmanager
def environment(name: str, value: str) -> Iterator[None]:
    """Set a variable of the environment in the block."""
    kept = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        del os.environ[name]
        if kept is not None:
            os.environ[name] = kept
