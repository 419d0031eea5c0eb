"""Our minutia directions are those that three other extractors give on real prints.

The prints and the other extractors' minutiae are not part of the project; where they are not
beside the checkout, the test is skipped.
"""

from dataclasses import replace
from pathlib import Path

import pytest

from fpmatch.image.enhancement._oriented_filter_kernel import COMPILED
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.lab.evaluation.databases.extraction import extract_datasets
from research.experiments.direction_agreement import measure_agreement

SHARED = Path(__file__).resolve().parents[2] / "shared"
PRINTS = SHARED / "fvc" / "fvc2002"
MINUTIAE = SHARED / "minutiae"
EVERY = 4 if COMPILED else 8  # of the prints of a database, for speed

pytestmark = pytest.mark.skipif(
    not (PRINTS.is_dir() and MINUTIAE.is_dir()),
    reason="the FVC2002 prints and other extractors' minutiae are not beside this checkout",
)


@pytest.mark.parametrize("name", ["DB1_B", "DB2_B"])  # 500 and 569 dpi
def test_directions_agree_and_are_not_flipped(name):
    dataset = load_dataset(PRINTS / name)
    some = replace(dataset, impressions=dataset.impressions[::EVERY])
    (prints,) = extract_datasets([some], workers=1)
    for extractor in ("mindtct", "fjfx", "sourceafis"):
        agreement = measure_agreement(prints, MINUTIAE / extractor / "fvc2002" / name)
        assert agreement.pairs >= 10 * len(some.impressions), extractor
        assert agreement.agreeing_share >= 0.85, extractor
        assert agreement.flipped_share <= 0.08, extractor
