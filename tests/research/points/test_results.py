import json
import math
import re

import pytest

from fpmatch.errors import FpmatchError
from research.points.conditions import Condition
from research.points.results import (
    BenchResults,
    PointCell,
    SkippedCell,
    read_results,
    write_results,
)

KEYS = [
    *("model", "matcher", "rho", "eta", "lambda", "m", "n", "trials"),
    *("recognised", "false_match", "time_ms", "scipy_delaunay_ms"),
]
CELL = PointCell(Condition("clutter", 9, 4), "triangles", "1101", 1, 5, 1.5, 3.0, 2.5, 1.6, 0)
SKIPPED = SkippedCell(Condition("patch", 3, 8), "astroalign", "a match was stopped after 20 s")


def results():
    early = PointCell(Condition("patch", 0, 2), "paper", "1", 0, 1, 0.1, 0.2, 0.3, 0.4, 1)
    return BenchResults({"trials": 4, "versions": {"scipy": None}}, [CELL, early], [SKIPPED])


def entry(**changes):
    return {**CELL.as_json(), **changes}


def test_a_cell_begins_with_its_condition_and_its_rates():
    values = ["clutter", "triangles", 0.9, 0.4, 0.84, 50, 200, 4, 0.75, 0.2, 1.5, 3.0]
    assert list(CELL.as_json().items())[: len(KEYS)] == list(zip(KEYS, values, strict=True))


def test_results_come_back_from_their_file_in_the_order_of_the_tables(tmp_path):
    path = tmp_path / "bench.json"
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_results(path, BenchResults({"budget_s": math.nan}))
    assert not path.exists()
    write_results(path, results())
    again = read_results(path)
    assert again.cells == results().cells[::-1]
    assert (again.settings, again.skipped) == (results().settings, [SKIPPED])
    assert again.cell(CELL.condition, "triangles") == CELL
    assert again.cell(CELL.condition, "paper") is None
    assert again.cell(Condition("patch", 9, 4), "triangles") is None
    assert list(json.loads(path.read_text())) == ["settings", "cells", "skipped"]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (None, "cannot be read: no such file"),
        (b"\xff\xfe\x00", "not a file of results"),
        (b"", "not a file of results: Expecting value"),
        (b"[]", "not a file of results"),
        (b"{}", "not a file of results: lacks 'cells'"),
        (b'{"cells": [{}]}', "not a file of results: lacks 'model'"),
        (b'{"cells": [7]}', "not a file of results"),
        (entry(m=51), "the paper's tables have no condition ('clutter', 0.9, "),
        ({k: v for k, v in entry().items() if k != "time_ms"}, "missing 1 required"),
    ],
)
def test_a_file_that_holds_no_results(tmp_path, content, reason):
    path = tmp_path / "bench.json"
    if content is not None:
        whole = content if isinstance(content, bytes) else json.dumps({"cells": [content]}).encode()
        path.write_bytes(whole)
    with pytest.raises(FpmatchError, match=f"^{re.escape(str(path))}: .*{re.escape(reason)}.*$"):
        read_results(path)
