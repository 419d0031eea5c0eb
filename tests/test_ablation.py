"""The ablation benchmark: every variant still finds what it replaces, and the table."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from fpmatch.matching.score import FEATURES
from research.ablation_table import format_ablation

ROOT = Path(__file__).resolve().parents[1]


def script() -> ModuleType:
    path = ROOT / "benchmarks" / "ablation.py"
    spec = importlib.util.spec_from_file_location("ablation", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["ablation"] = module
    spec.loader.exec_module(module)
    return module


ABLATION = script()


@pytest.mark.parametrize("variant", ABLATION.VARIANTS, ids=lambda variant: variant.name)
def test_what_a_variant_replaces_stands_in_the_source_once(variant) -> None:
    for file, old, new in variant.replaced:
        text = (ROOT / file).read_text(encoding="utf-8")
        assert text.count(old) == 1
        assert new != old
    assert set(variant.without) <= set(FEATURES)


def test_the_base_comes_first_and_names_differ() -> None:
    names = [variant.name for variant in ABLATION.VARIANTS]
    assert names[0] == "base"
    assert len(set(names)) == len(names)


def test_the_table_shows_rates_changes_and_identical_scores() -> None:
    rates = {"eer": 0.0123, "fmr1000": 0.03}
    row = {
        "mean": rates,
        "pooled": rates,
        "change": {"eer": [-0.001, 0.004], "fmr1000": None},
        "identical": 0.25,
    }
    table = format_ablation([{"name": "base", "with ridges": row, "minutiae alone": row}])
    assert table.count("| base | 1.23 / 3.00 | 1.23 / 3.00 | -0.10 to +0.40 | – | 25.0 % |") == 2
    assert table.index("with ridges") < table.index("minutiae alone")
