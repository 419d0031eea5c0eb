"""The ablation benchmark: every variant still finds what it replaces."""

from pathlib import Path

import pytest
from ablation import VARIANTS

from fpmatch.matching.score_model import FEATURES

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant.name)
def test_what_a_variant_replaces_stands_in_the_source_once(variant):
    for file, old, new in variant.replaced:
        assert (ROOT / file).read_text(encoding="utf-8").count(old) == 1
        assert new != old
    assert set(variant.without) <= set(FEATURES)
    names = [one.name for one in VARIANTS]
    assert names[0] == "base"
    assert names.count(variant.name) == 1
