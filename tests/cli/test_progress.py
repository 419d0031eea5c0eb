"""`fpmatch.cli.progress`: bars on a terminal, and none elsewhere."""

from __future__ import annotations

import io
import sys

import pytest

from fpmatch.cli.progress import ProgressBars


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def shown_on(stream: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(sys, "stderr", stream)
    with ProgressBars({"extract": "extracting prints", "compare": "comparing pairs"}) as bars:
        for stage, total in (("extract", 20), ("compare", 190)):
            for done in (0, total // 2, total):
                bars.show(stage, done, total)
    return stream.getvalue()


def test_a_bar_a_stage_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = shown_on(Terminal(), monkeypatch)
    assert shown.index("extracting prints") < shown.index("comparing pairs")
    assert shown.count("100%") >= 2


def test_nothing_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown_on(io.StringIO(), monkeypatch) == ""
