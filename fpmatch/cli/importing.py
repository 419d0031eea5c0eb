"""The imports of commands that take their time, out of the way of their workers."""

from __future__ import annotations

import gc
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextmanager
def importing() -> Iterator[None]:
    """Import without threads, which would keep a core busy, and without looking for garbage.

    Modules make none, and what they consist of is not looked through later either.
    """
    from fpmatch.engine.threads import loaded_single_threaded

    gc.disable()
    try:
        with loaded_single_threaded():
            yield
    finally:
        gc.freeze()
        gc.enable()
