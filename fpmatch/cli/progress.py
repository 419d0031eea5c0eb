"""Progress bars of commands that take their time."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


class ProgressBars:
    """Show one bar a stage on stderr, with time left and rate, and nothing where no terminal is.

    Parameters
    ----------
    labels : dict of str
        What stands before the bar of each stage.
    """

    def __init__(self, labels: Mapping[str, str]) -> None:
        self._labels = labels
        self._open = ExitStack()
        self._stage = ""
        self._bar: Any = None
        self._done = 0

    def __enter__(self) -> ProgressBars:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def show(self, stage: str, done: int, total: int) -> None:
        """Move the bar of `stage`, opening it first where it is a new one."""
        if not sys.stderr.isatty():
            return
        if stage != self._stage:
            self._open.close()
            bar: Any = click.progressbar(
                length=total,
                label=self._labels[stage],
                item_show_func=_rate_since(time.monotonic(), done),
                file=sys.stderr,
            )
            self._bar = self._open.enter_context(bar)
            self._stage, self._done = stage, 0
        self._bar.update(done - self._done, done)
        self._done = done


def _rate_since(start: float, first: int) -> Callable[[int | None], str | None]:
    """Return the function that words the rate, given how many are done."""

    def rate(done: int | None) -> str | None:
        seconds = time.monotonic() - start
        if done is None or done == first or seconds <= 0:
            return None
        return f"{(done - first) / seconds:.1f} a second"

    return rate
