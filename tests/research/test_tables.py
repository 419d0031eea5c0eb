"""Tables of the documentation: made of the kept results, and written between the marks of pages."""

import json

import pytest

from research import tables
from research.markdown import marked_block
from research.points.decision import count_accepted
from research.tables import BLOCKS, PARTS, format_decision


@pytest.fixture
def copied(tmp_path, monkeypatch):
    """Pages with all blocks but one, and copies of the results."""
    for page, mark in list(BLOCKS)[:-1]:
        path = tmp_path / page
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a") as stream:
            stream.write(f"# A page\n<!-- {mark}:start -->\nold\n<!-- {mark}:end -->\n")
    data = tmp_path / "data"
    data.mkdir()
    for part in PARTS.values():
        (data / part.file).write_bytes((tables.DATA / part.file).read_bytes())
    monkeypatch.setattr(tables, "ROOT", tmp_path)
    monkeypatch.setattr(tables, "DATA", data)
    return tmp_path


def test_blocks_are_written_and_a_missing_one_is_named(copied, run_research):
    done = run_research("tables")
    assert done.exit_code == 1
    missing = list(BLOCKS)[-1]
    assert f"{missing[0]}: has no block {missing[1]}" in done.output
    text = (copied / "docs/explanation/point_sets.md").read_text()
    assert marked_block(text, "measured").count("### ") == 6
    assert "written" not in run_research("tables").output
    assert "differs" not in run_research("tables", "--check").output


def test_measured_results_replace_those_of_a_part(copied, run_research, tmp_path):
    sets = [{"name": "mine", "genuine": 1, "impostor": 2, "accepted": [[1, 0]] * 4}]
    given = tmp_path / "given.json"
    given.write_text(json.dumps(sets))
    run_research("tables", "--keep", "decision", given)
    page = (copied / "docs/explanation/point_sets.md").read_text()
    assert "| mine | 100.0 % | 0.00 % |" in page
    given.write_text("{")
    assert run_research("tables", "--keep", "decision", given).exit_code == 2


def test_pairs_above_rho_are_counted_and_summed():
    import numpy as np

    similarity, genuine = np.array([0.55, 0.95, 0.65, 0.1]), np.array([1, 1, 0, 0], bool)
    row = count_accepted("one", similarity, genuine)
    assert row["accepted"] == [[2, 1], [1, 1], [1, 0], [1, 0]]
    last = format_decision([row, row]).splitlines()[-1]
    assert last.startswith("| all | 100.0 % | 50.00 % | 50.0 % | 50.00 % |")
