"""Plans of searches: less loss passes more on, larger galleries smaller shares; the training."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.loss import (
    LEAST_BY_RIDGES,
    LossTable,
    combined_scores,
    loss_table,
    search_plan,
)
from fpmatch.gallery.index.model import MODEL_FILE, IndexModel, index_model
from fpmatch.gallery.index.prints.descriptor_scores import size_normalized
from fpmatch.matching.compiled import COMPILED


@given(st.floats(1e-4, 0.5), st.integers(0, 10**9))
def test_a_plan_is_of_the_loss_and_within_the_gallery(loss, prints):
    plan = search_plan(loss, prints)
    assert plan.loss == loss
    assert plan.budget in loss_table().budgets
    assert min(prints, 10) <= plan.by_descriptors <= plan.by_terms <= prints
    assert min(plan.by_descriptors, LEAST_BY_RIDGES) <= plan.by_ridges <= plan.by_descriptors


def test_a_table_is_what_its_document_says():
    table, document = loss_table(), json.loads(MODEL_FILE.read_bytes())
    assert table.by_terms.tolist() == document["loss"]["by_terms"]
    for name, value in (
        ("losses", [0.1, 0.01]),
        ("prints", []),
        ("by_terms", [[0.5]]),
        ("by_descriptors", (table.by_descriptors + 2).tolist()),
        ("budgets", "none"),
    ):
        with pytest.raises(MatcherError, match="no table"):
            LossTable.of_document({"loss": {**document["loss"], name: value}})
    with pytest.raises(MatcherError, match="no table"):
        LossTable.of_document({})


def test_descriptors_and_votes_add_up():
    scores, sizes = np.array([40, 20, 30]), np.array([30, 30, 50], np.uint16)
    votes = np.array([0, 256, 512], np.uint16)
    alone = size_normalized(scores, sizes, 35)
    found = combined_scores(scores, sizes, votes, 35)
    assert found.tolist() == (alone + np.array([0.0, 1.0, 2.0])).tolist()


@pytest.mark.skipif(not COMPILED, reason="takes minutes")
@pytest.mark.parametrize("learned_on", ["databases", "mates"])
def test_the_index_is_trained_on_synthetic_prints(learned_on, tmp_path, request):
    from research.commands import research

    target = tmp_path / "index.json"
    command = ["train", "index", "--mates", "12", "--others", "60", "--into", str(target)]
    if learned_on == "databases":
        command.append(str(request.getfixturevalue("prints")))
    made = []
    for _ in range(2):
        found = CliRunner().invoke(research, command)
        assert found.exit_code == 0, found.output
        made.append(target.read_bytes())
    content, again = made
    assert content == again
    document = json.loads(content)
    assert learned_on in document["provenance"]
    model, table = IndexModel.of_document(document), LossTable.of_document(document)
    assert model.edges == pytest.approx(index_model().edges, rel=0.3)
    assert (np.diff(table.by_terms, axis=2) <= 0).all()  # a greater loss needs no more prints
    refused = CliRunner().invoke(research, [*command[:4], "--others", "0", "--into", str(target)])
    assert refused.exit_code == 2
    assert "between 1 and 65536" in refused.output
