"""The ablation benchmark: every variant still finds what it replaces."""

from __future__ import annotations

from pathlib import Path

import pytest
from ablation import VARIANTS

from fpmatch.matching.score_model import FEATURES

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant.name)
def test_what_a_variant_replaces_stands_in_the_source_once(variant) -> None:
    for file, old, new in variant.replaced:
        text = (ROOT / file).read_text(encoding="utf-8")
        assert text.count(old) == 1
        assert new != old
    assert set(variant.without) <= set(FEATURES)


def test_the_base_comes_first_and_names_differ() -> None:
    names = [variant.name for variant in VARIANTS]
    assert names[0] == "base"
    assert len(set(names)) == len(names)
