"""The page on large galleries says what was measured."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"


def test_the_tables_are_those_of_the_results(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "scripts")
    script = runpy.run_path(str(ROOT / "scripts" / "make_searching_table"))
    results = json.loads((DOCS / "data" / "searching.json").read_text(encoding="utf-8"))
    page = (DOCS / "explanation" / "searching.md").read_text(encoding="utf-8")
    shown = page.partition("<!-- measured:start -->")[2].partition("<!-- measured:end -->")[0]
    assert shown.strip() == script["format_markdown"](results).strip()
