"""The measurement of revocable templates, on the sample prints."""

from pathlib import Path

import pytest

from fpmatch.evaluation.databases.extraction import extract_datasets
from fpmatch.evaluation.run import load_datasets
from research.experiments.revocable import ATTACKS, measure_revocable
from research.tables.revocable import format_revocable

SAMPLES = Path(__file__).parents[2] / "sample_data"
pytestmark = pytest.mark.skipif(not SAMPLES.is_dir(), reason="the sample prints are not here")


@pytest.mark.slow
def test_one_key_links_the_prints_of_a_finger_and_two_keys_do_not():
    found = measure_revocable(extract_datasets(load_datasets([SAMPLES]), workers=1))
    (rates,) = found["sets"]
    assert rates["revocable"]["eer"] < 0.1
    by_attack = {one["attack"]: one["d_sys"] for one in found["linkability"]}
    assert len(by_attack) == len(ATTACKS) + 1
    assert by_attack["similarity, as templates of one key are compared"] == 0
    assert max(by_attack.values()) > 0.8  # of one key
    assert {one["mated"] for one in found["linkability"]} == {24}
    assert "50,688 bytes" in format_revocable({"measured": found})
