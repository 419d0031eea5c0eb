import numpy as np

from fpmatch.lab.evaluation.rates.scores_set import ScoresSet, Trials
from fpmatch.matching.calibration import Calibration
from research.experiments.fused_fingers import check_fusion, impostor_pairs
from research.tables.identification import format_fusion

SAME = Calibration(((0.0, 0.0), (100.0, 100.0)), tail_scale=1.0)


def scores_of(fingers, prints, similarity):
    finger = np.repeat(np.arange(fingers), prints)
    probe, reference = np.triu_indices(len(finger), k=1)
    trials = Trials(similarity(probe, reference), finger[probe], finger[reference], fingers)
    names = tuple(map(str, range(len(finger))))
    return ScoresSet("m", "s", names, probe, reference, trials, np.ones(len(probe), bool))


def test_print_k_of_a_finger_goes_with_print_k_of_the_other():
    scores = scores_of(4, 2, lambda i, j: 10.0 * i + j)
    pairs = impostor_pairs(scores, SAME, 1)
    # subjects: prints (0, 2), (1, 3) and (4, 6), (5, 7)
    assert pairs.tolist() == [[4.0, 26.0], [5.0, 27.0], [14.0, 36.0], [15.0, 37.0]]
    assert len(pairs) == 4
    apart = impostor_pairs(scores, SAME, 2)
    assert apart.tolist()[0] == [2.0, 46.0]  # subjects: prints (0, 4), (1, 5) and (2, 6), (3, 7)


def test_rates_of_independent_impostors_are_those_stated():
    rng = np.random.default_rng(0)
    sets = [scores_of(10, 8, lambda i, j: -10 * np.log10(rng.uniform(size=i.size)))]
    results = [check_fusion(sets, SAME, apart) for apart in (1, 5)]
    for one in results:
        assert one["pairs"] == 10 * 64
        assert one["rank_correlation"] < 0.15
        np.testing.assert_allclose(one["two_fingers"][:2], 1.0, atol=0.35)
    table = format_fusion(results)
    assert "two fingers, neighbouring, 640 pairs" in table
    assert "two fingers, 5 apart" in table
