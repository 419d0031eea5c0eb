"""`research.synthesis_page`: results become tables, and broken ones are refused."""

from __future__ import annotations

import json

import pytest

from fpmatch.errors import DatasetError
from research.image_statistics_table import TITLES
from research.synthesis_page import (
    PARTS,
    format_synthesis_markdown,
    preset_rows,
    read_synthesis_results,
)

EVALUATION = {
    "sets": [{"name": "easy", "eer": 0.0125}],
    "minutiae": {
        "sets": [
            {
                "name": "easy",
                "prints": 8,
                "agreement": [
                    {"distance_px": 16.0, "precision": 1.0, "recall": 1.0, "f1": 1.0},
                    {"distance_px": 12.0, "precision": 0.9, "recall": 0.8, "f1": 0.847},
                ],
                "transforms": {"genuine": 12, "judged": 10, "match": 0.99, "in_place": 0.975},
            }
        ]
    },
}


@pytest.fixture
def results():
    quantiles = {figure: [1.0, 2.0, 3.0, 4.0, 5.0] for figure in TITLES}
    outside = dict.fromkeys(TITLES, 0.25)
    return {
        "prints": {
            "sets": [{"name": "ours", "prints": 8, "quantiles": quantiles, "outside": outside}],
            "against": [{"name": "theirs", "prints": 9, "quantiles": quantiles}],
        },
        "presets": preset_rows(EVALUATION),
    }


def test_rows_of_presets_are_those_of_the_main_tolerance():
    assert preset_rows(EVALUATION) == [
        {
            **{"name": "easy", "eer": 0.0125, "prints": 8},
            **{"precision": 0.9, "recall": 0.8, "f1": 0.847},
            **{"judged": 10, "match": 0.99, "in_place": 0.975},
        }
    ]


def test_tables_show_what_was_measured(results):
    page = format_synthesis_markdown(results)
    assert "| ours | 8 | 3.00 (1.00–5.00) |" in page
    assert "| theirs | 9 |" in page
    assert "| 25 % | 25 % |" in page
    assert "| easy | 8 | 0.900 | 0.800 | 0.847 | 10 | 99.0 % | 97.5 % | 1.25 % |" in page


def test_every_row_of_a_table_has_as_many_cells_as_its_head(results):
    for block in format_synthesis_markdown(results).split("\n\n"):
        if block.startswith("|"):
            assert len({line.count("|") for line in block.splitlines()}) == 1


def test_results_come_back_from_their_file(tmp_path, results):
    (tmp_path / "r.json").write_text(json.dumps(results))
    assert read_synthesis_results(tmp_path / "r.json") == results


@pytest.mark.parametrize(
    ("content", "reason"),
    [("{", "not a JSON file"), ("[]", "lacks prints"), ('{"prints": {}}', "lacks presets")],
)
def test_files_that_hold_no_results_are_refused(tmp_path, content, reason):
    (tmp_path / "r.json").write_text(content)
    with pytest.raises(DatasetError, match=reason):
        read_synthesis_results(tmp_path / "r.json")
    with pytest.raises(DatasetError, match="cannot be read"):
        read_synthesis_results(tmp_path / "none.json")
    assert len(PARTS) == 2
