"""The tail of a calibration, of synthetic pairs: knots below stay, those above are their shares."""

import json
from unittest.mock import ANY

import numpy as np
import pytest

from fpmatch.errors import DatasetError
from fpmatch.matching.calibration import CALIBRATION_FOLDER, Calibration
from research.training.impostor_pairs import TAIL_FILE
from research.training.tail import kinds_of, with_tail

OWN = Calibration(((0.0, 0.0), (4.0, 30.0)), 2.0, 0.2, {"sets": ["FVC"], "impostors": 1000})
PAIRS = 10**8


def results(mean: float, share: float = 1.0) -> dict:
    """Return results of pairs with an exponential tail from a similarity of 3 on, 1 in 1,000."""
    count = PAIRS // 1000
    rank = (np.arange(count) + 0.5) / count
    high = 3.0 - mean * np.log(rank)
    searched = high[: round(share * count)]
    entry = {"similarity": searched.tolist(), "compared": high.tolist()}
    kind = {"name": "synthetic", "pairs": PAIRS, "searched": searched.tolist(), **entry}
    rare = {"name": "alone", "pairs": PAIRS, **dict.fromkeys(("compared", "searched"), [1.0] * 20)}
    return {"kinds": [kind, {**rare, "similarity": (4.0 * rank[:150]).tolist()}]}


def test_the_highest_knots_are_the_share_of_pairs() -> None:
    fitted = with_tail(OWN, results(mean=1.0))
    assert fitted.knots[:2] == OWN.knots
    assert fitted.knots[2] == (10.0, pytest.approx(60.4, abs=0.2))
    assert fitted.provenance["sets"] == ["FVC"]
    assert fitted.provenance["tail_from"] == 30.0
    for x in (10.0, 10.5, 11.0):
        assert fitted.score(x) == pytest.approx(30 + 10 / np.log(10) * (x - 3.0), abs=0.2)
    assert 60 < fitted.largest_measured_score < 70  # 20 of a hundred million pairs
    assert fitted.score(20.0) < 30 + 10 / np.log(10) * 17.0  # beyond, the tail is heavier


def test_own_knots_stay_up_to_the_first_of_forty_and_more() -> None:
    own = Calibration(((0.0, 0.0), (4.0, 39.5), (4.1, 40.5), (5.0, 45.0)), 2.0, 0.2)
    assert with_tail(own, results(mean=1.0)).knots[:4] == (*own.knots[:3], (10.0, ANY))


def test_a_tail_replaces_the_tail_before() -> None:
    once = with_tail(OWN, results(mean=1.0))
    assert with_tail(with_tail(OWN, results(mean=2.0)), results(mean=1.0)) == once
    assert Calibration.from_json(once.as_json()) == once


def test_pairs_that_a_search_loses_count() -> None:
    kind = kinds_of(results(mean=1.0, share=0.01))[0]
    assert kind.compares(3.0) == pytest.approx(0.01)
    assert kind.fmr(3.0) == pytest.approx(1e-3)


def test_too_few_pairs_make_no_tail() -> None:
    with pytest.raises(DatasetError, match="too few pairs"):
        with_tail(OWN, results(mean=0.01))


def test_the_tail_of_the_package_is_that_of_its_file() -> None:
    file = CALIBRATION_FOLDER / "unit-circle.json"
    shipped = Calibration.from_json(file.read_text(), file.name)
    assert with_tail(shipped, json.loads(TAIL_FILE.read_text())) == shipped
