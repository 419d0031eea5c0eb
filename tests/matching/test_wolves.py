"""Wolves: templates that were found to match many prints at a score of 40 must not any more.

`benchmarks/wolves.py` finds such templates. Those stored here were searched for on synthetic
prints, when the score did not yet depend on how much was compared; they are tried on prints of
other fingers.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from matching_prints import COMPILED
from stored_prints import stored_prints

from fpmatch.formats.files import load_template
from fpmatch.matching.verify import verify

WOLVES = sorted((Path(__file__).parent / "data" / "wolves").glob("*.json"))
THRESHOLD = 40.0
EVERY = 1 if COMPILED else 10
LARGEST_SHARE = 0.01
"""Of unseen prints that a wolf may match: a hundred times what the threshold states."""


def test_the_stored_prints_are_whole() -> None:
    prints = stored_prints()
    assert len(prints) == 120
    assert all(len(one.minutiae) >= 3 and one.field.mask.any() for one in prints)
    assert all(verify(one, one).match for one in prints[::20])


def test_stored_prints_of_different_fingers_do_not_match() -> None:
    probe, *others = stored_prints()
    assert not any(verify(probe, other).match for other in others[:40:EVERY])


@pytest.mark.parametrize("path", WOLVES, ids=lambda path: path.stem)
def test_a_wolf_matches_hardly_any_print(path: Path) -> None:
    wolf, prints = load_template(path), stored_prints()[::EVERY]
    matched = sum(verify(wolf, one, threshold=THRESHOLD).match for one in prints)
    assert matched <= LARGEST_SHARE * len(prints)
