"""Our minutia directions are those that three other extractors give on real prints.

The prints and the other extractors' minutiae are not part of the project; where they are not
beside the checkout, the test is skipped.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fpmatch.formats.files import load_record
from fpmatch.image.skeleton._thin_kernel import COMPILED
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.pointset.geometry.pairing import greedy_pairs
from research.databases import extract_datasets

SHARED = Path(__file__).resolve().parents[2] / "shared"
PRINTS = SHARED / "fvc" / "fvc2002"
MINUTIAE = SHARED / "minutiae"
SAME_PLACE_PX = 8.0
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
        turns = turns_between(prints, MINUTIAE / extractor / "fvc2002" / name)
        assert len(turns) >= 10 * len(some.impressions), extractor
        assert np.mean(turns <= 30) >= 0.85, extractor
        assert np.mean(turns > 150) <= 0.08, extractor


def turns_between(prints, folder):
    """Return how far directions differ, in degrees, where both extractors find a minutia.

    Neither set is the truth, but both use one convention (ISO/IEC 19794-2): mostly other directions
    show a wrong convention, many opposite ones that endings and bifurcations are confused.
    """
    turns = []
    for impression, template in zip(prints.impressions, prints.templates, strict=True):
        record = load_record(folder / f"{impression.path.stem}.csv", file_format="minutiae-csv")
        ours, theirs = template.minutiae, record.single().template.minutiae
        i, j = greedy_pairs(ours.xy, theirs.xy, SAME_PLACE_PX).T
        difference = np.degrees(ours.angle[i].astype(float) - theirs.angle[j])
        turns.append(np.abs((difference + 180) % 360 - 180))
    return np.concatenate(turns)
