"""Wolves: templates that were found to match many prints at a score of 40 must not any more.

A search found such templates. Those stored here were searched for on
synthetic prints, the small ones when the score did not yet depend on how much was compared, that of
21 minutiae when pairs were not held against chance; they are tried on prints of other fingers.

Those are stored small, no two of one finger: the first impressions of every other finger of the
eight databases that `research.databases` makes from seed 601 on, 30 fingers each; positions in
eighths of a pixel, directions in 2048ths of a turn, ridge orientations in 256ths of half a turn.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matching_prints import COMPILED

from fpmatch.formats.files import load_template
from fpmatch.gallery.listing.two_prints import find_doubts
from fpmatch.matching.verify import verify
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

WOLVES = sorted((Path(__file__).parent / "data" / "wolves").glob("*.json"))
PRINTS = Path(__file__).with_name("data") / "synthetic_prints.npz"
STEP_PX = 16.0
THRESHOLD = 40.0
EVERY = 1 if COMPILED else 10
LARGEST_SHARE = 0.01
"""Of unseen prints that a wolf may match: a hundred times what the threshold states."""


@cache
def stored_prints():
    """Return all of them, with their ridges."""
    with np.load(PRINTS) as stored:
        column = dict(stored)
    found, cell, octet = [], 0, 0
    for k, (width, height, rows, columns) in enumerate(column["size"].tolist()):
        x, y, angle, kind, quality = (
            column["minutiae"][slice(*column["minutiae_start"][k : k + 2])].astype(float).T
        )
        octets = -(-rows * columns // 8)
        bits = np.unpackbits(column["mask"][octet : octet + octets], count=rows * columns)
        mask = bits.reshape(rows, columns).astype(bool)
        own = slice(cell, cell + int(mask.sum()))
        octet, cell = octet + octets, own.stop
        orientation, ridges = np.zeros(mask.shape, np.float32), np.zeros(mask.shape, np.uint64)
        orientation[mask] = column["orientation"][own] * (np.pi / 256)
        ridges[mask] = column["ridges"][own]
        minutiae = Minutiae(x / 8, y / 8, angle * (np.pi / 1024), kind, quality)
        field = RidgeField(STEP_PX, orientation, mask, ridges)
        found.append(Template(minutiae, width, height, field=field))
    return found


def test_the_stored_prints_are_whole():
    prints = stored_prints()
    assert len(prints) == 120
    assert all(len(one.minutiae) >= 3 and one.field.mask.any() for one in prints)
    assert all(verify(one, one).match for one in prints[::20])


def test_stored_prints_of_different_fingers_do_not_match():
    probe, *others = stored_prints()
    assert not any(verify(probe, other).match for other in others[:40:EVERY])


@pytest.mark.parametrize("path", WOLVES, ids=lambda path: path.stem)
def test_a_wolf_matches_hardly_any_print(path):
    wolf, prints = load_template(path), stored_prints()[::EVERY]
    matched = sum(verify(wolf, one, threshold=THRESHOLD).match for one in prints)
    assert matched <= LARGEST_SHARE * len(prints)


@pytest.mark.parametrize("count", [7, 8])
def test_small_wolves_are_named_as_two_prints(count):
    """They reach 30 three and ten times as often as stated, of 12,000 prints without ridges."""
    wolf = load_template(WOLVES[0].with_name(f"{count}-minutiae-with-ridges.json"))
    assert "two prints in one" in " ".join(find_doubts(wolf))


@pytest.mark.parametrize("ridges", [True, False])
def test_frequent_minutiae_are_expected_to_pair(ridges):
    """At 30, 21 minutiae with ridges matched 6 of these prints given as minutiae alone."""
    wolf = load_template(WOLVES[0].with_name("21-minutiae-with-ridges.json"))
    forms = (one if ridges else replace(one, field=None) for one in stored_prints()[::EVERY])
    assert sum(verify(wolf, one, threshold=30.0).match for one in forms) <= 1


@pytest.mark.parametrize("low", [1, 5])
def test_quality_that_a_few_minutiae_have_alone_changes_no_score(low):
    """A search left one minutia in 18 its quality, so that no other counted as unpaired."""
    probe, *others = (replace(one, field=None) for one in stored_prints()[: 20 * EVERY : EVERY])
    m = probe.minutiae
    quality = np.where(np.arange(len(m)) < len(m) // 8, 25, low)

    def scores(given):
        made = replace(probe, minutiae=Minutiae(m.x, m.y, m.angle, m.kind, given))
        return [verify(made, one).score for one in (probe, *others)]

    assert scores(quality) == scores(np.full(len(m), 100))


def test_of_seven_minutiae_two_may_not_have_nearly_all_of_the_quality():
    """A search gave two of seven minutiae a quality of 76 and 71, the others of 20 and less."""
    probe, *others = stored_prints()[: 20 * EVERY : EVERY]
    m = probe.minutiae

    def scores(quality):
        few = Minutiae(m.x[:7], m.y[:7], m.angle[:7], m.kind[:7], np.array(quality))
        return [verify(replace(probe, minutiae=few), one).score for one in (probe, *others)]

    assert scores([76, 71, 20, 20, 20, 16, 1]) == scores([100] * 7)
    assert scores([76, 71, 50, 50, 40, 36, 31]) != scores([100] * 7)
