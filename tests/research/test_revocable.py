from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import research  # noqa: F401  (puts the example on the path)
from fpmatch.gallery.encryption.keys import Key
from fpmatch.lab.evaluation.databases.extraction import extract_datasets
from fpmatch.lab.evaluation.run import load_datasets
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.prints.prepare import prepare
from fpmatch_revocable.cells import pair_cells
from fpmatch_revocable.template import RevocableTemplate, protect
from research.attacks import linkage
from research.attacks.linkage import (
    ATTACKS,
    SAME_KEY,
    PrintSet,
    d_sys,
    judged,
    linkability,
    open_template,
)
from research.experiments.revocable import measure_revocable
from research.tables.revocable import format_revocable

SAMPLES = Path(__file__).parents[2] / "sample_data"
ONE, OTHER = Key(bytes(range(32))), Key(bytes(32))
FINGERS, IMPRESSIONS = 6, 4


@pytest.fixture(scope="module")
def prints():
    templates = list(make_templates(5, range(FINGERS), IMPRESSIONS, preset="easy"))
    return PrintSet(templates, np.repeat(np.arange(FINGERS), IMPRESSIONS))


@pytest.fixture(autouse=True)
def few_orders(monkeypatch):
    monkeypatch.setattr(linkage, "ORDERS", 40)


def leaking(template, key, bits):
    """Return a template whose words show some bits of the cells, as of a weak cipher."""
    made = protect(template, key)
    cells = open_template(made, template, key).words
    shown = (cells % (1 << bits)) << (32 - bits)
    words = np.where(cells > 0, shown | (made.words >> bits), made.words)
    return RevocableTemplate(np.sort(words.astype(np.uint32), axis=1), made.key_id)


@pytest.mark.slow
def test_no_attack_links_two_keys_and_one_key_is_linked(prints):
    rows = {row["attack"]: row for row in linkability([prints], (ONE, OTHER))}
    assert set(rows) == {*ATTACKS, SAME_KEY}
    for name in ATTACKS:
        for case in ("unknown", "known"):
            one = rows[name][case]
            assert one["d_sys"] <= one["by_chance"] + 0.05, (name, case)
            assert one["mated"] == FINGERS * IMPRESSIONS**2
    assert rows[SAME_KEY]["known"]["d_sys"] > 0.8
    assert rows[SAME_KEY]["known"]["eer"] < 0.1


@pytest.mark.parametrize("name", ["high 16 bits in common", "histogram of the highest bytes"])
def test_words_that_keep_bits_of_their_cells_are_linked(prints, name):
    sides = [[leaking(one, key, 16) for one in prints.templates] for key in (ONE, OTHER)]
    found = judged([prints], ATTACKS[name], *([side] for side in sides))
    assert found["d_sys"] > 2 * found["by_chance"]
    assert found["eer"] < 0.3


def test_a_known_key_opens_all_cells_of_a_template(prints):
    template = prints.templates[0]
    cells, _ = pair_cells(prepare(template))
    opened = open_template(protect(template, ONE), template, ONE).words
    assert set(opened[opened > 0].tolist()) == set(cells.tolist()) - {0}
    assert not open_template(protect(template, OTHER), template, ONE).words.any()


@pytest.mark.slow
@pytest.mark.skipif(not SAMPLES.is_dir(), reason="the sample prints are not here")
def test_the_table_has_each_attack_and_dictionary(monkeypatch):
    monkeypatch.setattr(linkage, "CELLS", 1 << 20)
    sets = extract_datasets(load_datasets([SAMPLES]), workers=1)
    found = measure_revocable(sets, fingers=0, strangers=20)
    (rates,) = found["sets"]
    assert rates["revocable"]["eer"] < 0.1
    assert found["dictionary"]["known"]["nearest"] > 0.9
    assert found["dictionary"]["unknown"]["match"] == 0
    table = format_revocable({"measured": found})
    assert "50,688 bytes" in table
    assert all(f"| {name} |" in table for name in (*ATTACKS, SAME_KEY))


VALUES = st.lists(st.floats(-10, 10), min_size=1, max_size=60)


@given(VALUES, VALUES)
def test_d_sys_lies_between_0_and_1(mated, non_mated):
    assert 0 <= d_sys(mated, non_mated) <= 1


@given(VALUES)
def test_equal_samples_are_not_linked(values):
    assert d_sys(values, values) == 0


def test_samples_are_linked_as_far_as_their_distributions_differ(rng):
    assert d_sys(rng.uniform(0, 1, 500), rng.uniform(2, 3, 900)) == 1
    # where both occur the ratio is 1; the other half of the mated values is linked surely
    by_half = d_sys(rng.uniform(0, 2, 20_000), rng.uniform(1, 3, 20_000))
    assert by_half == pytest.approx(0.5, abs=0.03)
    assert d_sys(rng.normal(size=20_000), rng.normal(size=20_000)) < 0.06


def test_the_prior_ratio_counts():
    mated, non_mated = [0.0] * 30 + [1.0] * 10, [0.0] * 10 + [1.0] * 30
    assert d_sys(mated, non_mated) == pytest.approx(0.75 * (2 * 3 / 4 - 1))
    assert d_sys(mated, non_mated, omega=1 / 3) == 0
