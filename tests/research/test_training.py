import json
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from fpmatch.gallery.index.terms import MODEL_FILE, TERMS, index_model
from fpmatch.image.quality.measures import QualityMeasures
from fpmatch.image.quality.print_quality import (
    FEATURES,
    quality_features,
    quality_score,
    shipped_weights,
)
from fpmatch.lab.synthesis.master import MasterParameters, make_master
from fpmatch.lab.synthesis.sensor import Sensor
from fpmatch.matching.calibration import CALIBRATION_FOLDER
from research.commands import ROOT
from research.training.index import document_of, model_of_edges
from research.training.quality import BETTER, FAULTS, fit_quality, spoilt_impression

SENSOR = Sensor("small", 160, 180)


def examples(rng, sign):
    """Return prints that compare the better (sign 1) or worse (-1) the more ridges they have."""
    areas = rng.uniform(20, 300, 60)
    figures = [QualityMeasures(370, a, 30, 0.45, rng.uniform(0.3, 1), 0.3, 9, 0.02) for a in areas]
    shares = 1 / (1 + np.exp(-sign * 2 * np.log(areas / 100)))
    return figures, shares.tolist()


@pytest.fixture(scope="module")
def master():
    return make_master(7, 1, MasterParameters(shape=(240, 220)))


def test_more_ridges_are_better_where_examples_say_so(rng):
    weights = fit_quality(*examples(rng, 1))
    assert weights.weight[FEATURES.index("ridges")] > 0.5
    figures = QualityMeasures(370, 200, 30, 0.45, 0.5, 0.3, 9, 0.02)
    less = replace(figures, ridges_mm2=50)
    assert quality_score(quality_features(less), weights) < 50
    assert quality_score(quality_features(figures), weights) > 50


def test_no_examples_make_less_of_a_print_better(rng):
    assert fit_quality(*examples(rng, -1)).weight[FEATURES.index("ridges")] == 0


def test_the_weights_of_the_package_praise_no_fault():
    weight = shipped_weights().weight
    assert all(w >= 0 if better else w <= 0 for w, better in zip(weight, BETTER, strict=True))


@pytest.mark.parametrize("fault", sorted(set(FAULTS)))
def test_every_fault_can_be_made_and_made_again(master, fault):
    one, other = (
        spoilt_impression(master, 1, fault, SENSOR, np.random.default_rng(3)) for _ in range(2)
    )
    assert np.array_equal(one[0], other[0])
    assert one[0].dtype == np.uint8
    assert one[1] == other[1] == SENSOR.dpi


def test_a_model_has_the_shares_of_lengths_and_of_directions_from_either_end(rng):
    terms = rng.integers(0, TERMS, 500).astype(np.uint16)
    model = model_of_edges(terms, 9)
    assert model.lengths.sum() == pytest.approx(1)
    assert model.directions.sum() == pytest.approx(1)
    assert model.edges == len(terms) / 9
    # from the other end, the two sides change places, and the curvature its sign
    other = np.roll(model.directions.transpose(1, 0, 2), (12, 12), (0, 1))
    other = other[:, :, [5, 4, 3, 2, 1, 0, 6]]
    assert other == pytest.approx(model.directions)


def test_the_model_of_the_package_is_written_as_it_is():
    document = json.loads(MODEL_FILE.read_bytes())
    assert document_of(index_model()) == {
        name: document[name] for name in ("lengths", "directions", "edges")
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("quality", "--fingers", 1, "--workers", 1),
        ("tail", "--prints", 9, "--probes", 3),
        ("enhancer", "--fingers", 1, "--steps", 2, "--workers", 1),
        ("embedding", "--fingers", 4, "--steps", 2, "--workers", 1),
    ],
    ids=lambda words: words[0],
)
def test_the_same_training_writes_the_same_file(tmp_path, words):
    if words[0] in {"enhancer", "embedding"}:
        pytest.importorskip("torch", reason="the extra train is not installed")
    files = tmp_path / "one", tmp_path / "two"
    for file in files:
        command = [sys.executable, "-m", "research", "train", *map(str, words), "--into", str(file)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert str(file) in done.stdout
    assert files[0].read_bytes() == files[1].read_bytes()


def test_the_same_calibration_is_fitted_again(tmp_path, run_research):
    shipped = CALIBRATION_FOLDER / "unit-circle.json"
    shutil.copy(shipped, tmp_path)
    done = run_research("calibrate", "--tail", "--into", tmp_path)
    assert done.exit_code == 0, done.output
    assert (tmp_path / shipped.name).read_bytes() == shipped.read_bytes()


@pytest.mark.parametrize(
    ("words", "needed"),
    [
        (["calibrate"], "needs FVC-style databases DIR, --synthetic or --tail"),
        (["calibrate", "nowhere"], "nowhere"),
        (["check", "polarity", "nowhere"], "nowhere"),
        (["measure", "decision", "nowhere"], "nowhere"),
    ],
)
def test_data_that_is_missing_is_named_in_one_line(run_research, words, needed):
    done = run_research(*words)
    assert (done.exit_code, done.stdout) == (2, "")
    assert needed in done.stderr
    assert done.stderr.count("\n") == 1
