"""Our minutia directions are those that three other extractors give on real prints.

The prints and the other extractors' minutiae are not part of the project; where they are not
beside the checkout, the test is skipped. `scripts/check_conventions` makes the same table from all
prints.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import pytest

from fpmatch.evaluation.agreement import measure_agreement
from fpmatch.evaluation.dataset import load_dataset
from fpmatch.evaluation.extraction import ExtractedSet, extract_datasets

SHARED: Final = Path(__file__).resolve().parents[2] / "shared"
PRINTS: Final = SHARED / "fvc" / "fvc2002"
MINUTIAE: Final = SHARED / "minutiae"
EVERY: Final = 4  # of the prints of a database, for speed

pytestmark = pytest.mark.skipif(
    not (PRINTS.is_dir() and MINUTIAE.is_dir()),
    reason="the FVC2002 prints and other extractors' minutiae are not beside this checkout",
)


@pytest.fixture(scope="module", params=["DB1_B", "DB2_B"])
def prints(request: pytest.FixtureRequest) -> ExtractedSet:
    """Return some prints of a database with our templates (DB1_B: 500 dpi, DB2_B: 569 dpi)."""
    dataset = load_dataset(PRINTS / request.param)
    some = replace(dataset, impressions=dataset.impressions[::EVERY])
    (found,) = extract_datasets([some], workers=1)
    return found


@pytest.mark.parametrize("extractor", ["mindtct", "fjfx", "sourceafis"])
def test_directions_agree_and_are_not_flipped(prints: ExtractedSet, extractor: str) -> None:
    folder = MINUTIAE / extractor / "fvc2002" / prints.dataset.impressions[0].path.parent.name
    agreement = measure_agreement(prints, folder)
    assert agreement.pairs >= 10 * len(prints.dataset.impressions)
    assert agreement.agreeing_share >= 0.85
    assert agreement.flipped_share <= 0.08
