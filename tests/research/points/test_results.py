"""The file that keeps the results."""

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
    """Return the least that a cell of the file has to say."""
    values = ("patch", "triangles", 0.95, 0.175, 0.428, 50, 100, 4, 0.75, 0.0, 1.5, 3.0)
    return {**dict(zip(KEYS, values, strict=True)), **changes}


def test_a_cell_begins_with_the_keys_that_were_agreed_which_are_enough(tmp_path):
    values = ["clutter", "triangles", 0.9, 0.4, 0.84, 50, 200, 4, 0.75, 0.2, 1.5, 3.0]
    assert list(CELL.as_json().items())[: len(KEYS)] == list(zip(KEYS, values, strict=True))
    path = tmp_path / "bench.json"
    path.write_text(json.dumps({"cells": [entry()]}))
    (cell,) = read_results(path).cells
    assert (cell.condition, cell.true_positives, cell.trials) == (Condition("patch", 0, 2), 3, 4)
    assert (cell.false_positive_rate, cell.independent_trials, cell.time_ms) == (0.0, 4, 1.5)


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
        (entry(m=51), "the paper's tables have no condition ('patch', 0.95, "),
        (entry(recognised=1.5), "a rate must be a fraction: 1.5"),
        (entry(time_ms=0), "a time must be positive: 0"),
        (entry(time_ms=None), "a time must be positive: None"),
        (entry(trials=0), "trials and outcomes disagree: triangles, patch, rho 0.95, m 50, n 100"),
        (entry(outcomes="1100"), "trials and outcomes disagree"),
        (entry(outcomes="1110x"), "trials and outcomes disagree"),
        (entry(independent_trials=0), "trials and outcomes disagree"),
    ],
)
def test_a_file_that_holds_no_results(tmp_path, content, reason):
    path = tmp_path / "bench.json"
    if content is not None:
        whole = content if isinstance(content, bytes) else json.dumps({"cells": [content]}).encode()
        path.write_bytes(whole)
    with pytest.raises(FpmatchError, match=f"^{re.escape(str(path))}: .*{re.escape(reason)}.*$"):
        read_results(path)
