"""The measurement of revocable templates, on the sample prints, and the attacks on them."""

from pathlib import Path

import numpy as np
import pytest

from fpmatch.base.encryption.keys import Key
from fpmatch.lab.evaluation.databases.extraction import extract_datasets
from fpmatch.lab.evaluation.run import load_datasets
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.prints.prepare import prepare
from fpmatch_revocable.cells import pair_cells
from fpmatch_revocable.template import RevocableTemplate, protect
from research.attacks import linkage
from research.attacks.linkage import ATTACKS, SAME_KEY, PrintSet, judged, linkability, open_template
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
