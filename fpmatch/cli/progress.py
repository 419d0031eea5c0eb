"""Bars on a terminal that show how far long work has come."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Mapping


class ProgressBars:
    """Show one bar a stage on stderr, with label, time left and rate, where it is a terminal."""

    def __init__(self, labels: Mapping[str, str]) -> None:
        self._labels = labels
        self._open = ExitStack()
        self._bar: Any = None
        self._stage, self._done = "", 0
        self._start, self._first = 0.0, 0

    def __enter__(self) -> ProgressBars:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def show(self, stage: str, done: int, total: int, text: str | None = None) -> None:
        """Move the bar of `stage`, opened where it is a new one; `text` replaces the rate."""
        if not sys.stderr.isatty():
            return
        if stage != self._stage or done < self._done:
            self._open.close()
            bar: Any = click.progressbar(
                length=total,
                label=self._labels[stage],
                item_show_func=lambda shown: shown,
                file=sys.stderr,
            )
            self._bar = self._open.enter_context(bar)
            self._stage, self._done = stage, 0
            self._start, self._first = time.monotonic(), done
        self._bar.update(done - self._done, text or self._rate(done))
        self._done = done

    def _rate(self, done: int) -> str | None:
        seconds = time.monotonic() - self._start
        return f"{(done - self._first) / seconds:.1f} a second" if done > self._first else None
