"""Bars on a terminal that show how far long work has come."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Mapping


class ProgressBars(ExitStack):
    """Show one bar a stage on stderr, with label and time left, where it is a terminal."""

    def __init__(self, labels: Mapping[str, str]) -> None:
        super().__init__()
        self._labels = labels
        self._stage = ""
        self._bar: Any = None

    def show(self, stage: str, done: int, total: int, text: str | None = None) -> None:
        """Move the bar of `stage`, opened where it is a new one, with a `text` beside it."""
        if not sys.stderr.isatty():
            return
        if stage != self._stage or done < self._bar.pos:
            self.close()
            bar = click.progressbar(
                length=total,
                label=self._labels[stage],
                item_show_func=lambda shown: shown,
                file=sys.stderr,
            )
            self._stage, self._bar = stage, self.enter_context(bar)
        self._bar.update(done - self._bar.pos, text)
