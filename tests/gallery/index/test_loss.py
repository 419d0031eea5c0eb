"""Plans of searches: less loss passes more on, larger galleries smaller shares; the training."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.loss import (
    EARLY_LOSS,
    EARLY_SHARE,
    LEAST_BY_RIDGES,
    RIDGE_WEIGHT,
    TIMES,
    LossTable,
    chosen_by_ridges,
    combined_scores,
    loss_table,
    search_plan,
    search_rounds,
    with_ridges,
)
from fpmatch.gallery.index.model import MODEL_FILE, IndexModel, index_model
from fpmatch.gallery.index.prints.descriptor_scores import size_normalized
from fpmatch.matching.pipeline._kernels import _local_kernel


@given(st.floats(1e-4, 0.5), st.integers(0, 10**9))
def test_a_plan_is_of_the_loss_and_within_the_gallery(loss, prints):
    plan = search_plan(loss, prints)
    assert plan.loss == loss
    assert plan.budget in loss_table().budgets
    assert min(prints, 10) <= plan.by_descriptors <= plan.by_terms <= prints
    assert min(plan.by_descriptors, LEAST_BY_RIDGES) <= plan.by_ridges <= plan.by_descriptors


@pytest.mark.parametrize("prints", [30_000, 1_000_000, 10_000_000])
def test_a_plan_of_less_loss_costs_more(prints):
    plans = [search_plan(loss, prints) for loss in (0.1, 0.05, 0.02, 0.01)]
    work = [p.cost(prints) for p in plans]
    assert work == sorted(work)


@pytest.mark.parametrize("loss", [0.002, 0.005, 0.01])
def test_a_threshold_makes_a_search_cost_less(loss):
    plans = [search_plan(loss, 1_000_000, threshold) for threshold in (0.0, 60.0, 85.0, 92.0)]
    assert plans[0] == plans[1]  # of a million, all that are found reach it
    work = [p.cost(1_000_000) for p in plans]
    assert work == sorted(work, reverse=True)
    assert work[-1] < 0.7 * work[0]


@given(st.floats(1e-3, 0.3), st.integers(0, 10**8), st.sampled_from([0.0, 50.0, 75.0, 100.0]))
def test_early_rounds_look_for_clear_mates_at_a_share_of_the_cost(loss, prints, threshold):
    *early, (last, never) = search_rounds(loss, prints, threshold)
    assert (last, never) == (search_plan(loss, prints, threshold), np.inf)
    assert [(last, never)] == search_rounds(loss, prints, threshold, all_mates=True)
    decisive = max(threshold, 10 * np.log10(TIMES * max(prints, 1)))
    assert all(score == decisive for _, score in early)
    plan = search_plan(EARLY_LOSS, prints, threshold, TIMES)
    worthwhile = plan.cost(prints) < EARLY_SHARE * last.cost(prints)
    assert [plan for plan, _ in early] == [plan] * worthwhile


def test_without_a_measured_loss_all_prints_are_passed_on():
    table = loss_table()
    plan = table.plan(float(table.losses[0]) / 10, 50_000)
    assert (plan.by_terms, plan.by_descriptors) == (50_000, 50_000)


@pytest.mark.parametrize("loss", [0, 1, -0.1, 2, float("nan")])
def test_what_is_no_loss_is_refused(loss):
    with pytest.raises(MatcherError, match="between 0 and 1"):
        search_plan(loss, 1000)


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


def test_ridges_count_by_their_standard_deviations_and_unknown_ones_come_first():
    scores, agreement = np.array([3.0, 1.0, 2.0, 0.0]), np.array([5.0, np.nan, 7.0, 9.0])
    of_known = (scores + RIDGE_WEIGHT * np.array([-1, np.nan, 0, 1]) * np.sqrt(1.5))[[0, 2, 3]]
    combined = with_ridges(scores, agreement)
    assert combined[[0, 2, 3]] == pytest.approx(of_known)
    assert combined[1] == np.inf
    assert with_ridges(scores, np.full(4, 2.0)).tolist() == scores.tolist()
    assert (with_ridges(scores, np.full(4, np.nan)) == np.inf).all()


@given(st.integers(0, 9), st.lists(st.sampled_from([0.0, 1.0, 2.0, np.nan]), max_size=12))
def test_half_of_the_prints_are_passed_on_by_ridges_and_half_without(most, agreement):
    scores = np.arange(float(len(agreement)))
    agreement = np.array(agreement, float)
    chosen = chosen_by_ridges(scores, agreement, most)
    unknown = np.flatnonzero(np.isnan(agreement))
    assert np.isin(unknown, chosen).all()
    assert len(chosen) == min(len(scores), len(unknown) + most)
    first = np.argsort(-with_ridges(scores, agreement), kind="stable")
    assert np.isin(first[: len(unknown) + most - most // 2], chosen).all()
    assert np.isin(np.setdiff1d(np.arange(len(scores)), unknown)[::-1][: most // 2], chosen).all()


@pytest.mark.skipif(not _local_kernel.COMPILED, reason="takes minutes")
@pytest.mark.parametrize("learned_on", ["databases", "mates"])
def test_the_index_is_trained_on_synthetic_prints(learned_on, tmp_path, request):
    from research.commands import research

    target = tmp_path / "index.json"
    command = ["train", "index", "--mates", "12", "--others", "60", "--into", str(target)]
    if learned_on == "databases":
        command.append(str(request.getfixturevalue("prints")))
    for _ in range(2):
        found = CliRunner().invoke(research, command)
        assert found.exit_code == 0, found.output
        content = target.read_bytes()
        again = content if target.exists() else None
    assert content == again
    document = json.loads(content)
    assert learned_on in document["provenance"]
    model, table = IndexModel.of_document(document), LossTable.of_document(document)
    assert model.edges == pytest.approx(index_model().edges, rel=0.3)
    assert (np.diff(table.by_terms, axis=2) <= 0).all()  # a greater loss needs no more prints
    refused = CliRunner().invoke(research, [*command[:4], "--others", "0", "--into", str(target)])
    assert refused.exit_code == 2
    assert "between 1 and 65536" in refused.output
