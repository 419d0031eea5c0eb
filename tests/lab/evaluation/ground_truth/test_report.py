import json
from collections import Counter

import numpy as np
import pytest
from truth_files import truth_document, truth_of, write_truth

from fpmatch.lab.evaluation.ground_truth.minutiae_counts import TOLERANCES, Cause, MinutiaeCounts
from fpmatch.lab.evaluation.ground_truth.report import (
    measure_minutiae,
    measure_print,
)
from fpmatch.lab.evaluation.ground_truth.truth import load_truth
from fpmatch.lab.evaluation.run import evaluate, load_datasets
from fpmatch.templates.minutiae import Minutiae, Template

TRUE = Minutiae(x=[60, 100, 140], y=[80, 80, 80], angle=[0, 0, 0], kind=[1, 1, 2])


def test_a_print_is_measured_at_all_tolerances_with_and_without_kind():
    """Of four, one is near, one 10 px off, one of another kind, one 14 px off; one is false."""
    found = Minutiae(x=[60, 110, 140, 154], y=[80] * 4, angle=[0] * 4, kind=[1, 1, 1, 2])
    result = measure_print(Template(found, 200, 160), truth_of(TRUE))
    assert [c.true_positives for c in result.counts] == [3, 3, 2]
    assert [c.true_positives for c in result.with_kind] == [3, 2, 1]
    assert result.main == MinutiaeCounts(true_positives=3, false_positives=1)
    assert result.causes == Counter({Cause.OTHER: 1})


@pytest.fixture
def report(options, make_database):
    """Two databases; the extractor finds one minutia a print, and never where a true one is."""
    folders = [make_database("a", 3, 2), make_database("b", 2, 2, contents={"1_1": "broken"})]
    return measured(folders, options)


def measured(folders, options, **changes):
    datasets = load_datasets(folders)
    for folder, dataset in zip(folders, datasets, strict=True):
        document = truth_document(*(i.path.stem for i in dataset.impressions), **changes)
        if changes:
            document["minutiae"] = {"x": changes["x"], "y": changes["x"]}
        for finger in {impression.finger for impression in dataset.impressions}:
            write_truth(folder, document, finger)
    truths = [load_truth(dataset) for dataset in datasets]
    return measure_minutiae(evaluate(datasets, **options), truths)


def test_rows_follow_the_databases_and_are_pooled(report):
    a, b = report.sets
    assert [name for name, _ in b.prints] == ["1_1.tif", "1_2.tif", "2_1.tif", "2_2.tif"]
    assert a.total.main == MinutiaeCounts(false_negatives=12, false_positives=6)
    assert b.total.main == MinutiaeCounts(false_negatives=8, false_positives=3)
    assert report.pooled.total.main == MinutiaeCounts(false_negatives=20, false_positives=9)
    assert (a.genuine, b.genuine, report.pooled.genuine) == (3, 2, 5)
    assert sum(report.pooled.total.causes.values()) == 9
    assert report.pooled.transforms.judged == 0  # too little in common
    document = json.loads(json.dumps(report.as_json(), allow_nan=False))
    a, _ = document["sets"]
    assert (a["name"], a["prints"], a["extracted"], a["true"]) == ("a", 6, 6, 12)
    assert [row["distance_px"] for row in a["agreement"]] == [t.distance_px for t in TOLERANCES]
    assert a["agreement"][1]["turn_deg"] == 22.5
    assert (a["agreement"][1]["f1"], a["agreement"][1]["with_kind"]["recall"]) == (0, 0)
    causes = a["false_positives_by_cause"]
    assert list(causes) == ["direction", "border", "no_ridges", "near_another", "other"]
    assert (a["transforms"]["genuine"], a["transforms"]["match"]) == (3, None)
    counts = {"true_positives": 0, "false_negatives": 2, "false_positives": 1, "ignored": 0}
    shares = {"precision": 0, "recall": 0, "f1": 0}
    by_cause = a["by_print"][0].pop("false_positives_by_cause")
    assert a["by_print"][0] == {"name": "1_1.tif", **counts, **shares}
    assert sum(by_cause.values()) == 1
    assert document["pooled"]["true"] == 20
    assert "by_print" not in document["pooled"]


def test_pairs_with_enough_in_common_are_judged(options, make_database):
    along = np.arange(12, dtype=float).tolist()
    columns = {"x": along, "y": along[::-1], "angle_deg": along, "kind": [1] * 12}
    found = measured([make_database("a", 2, 2)], options, **columns, master=list(range(12)))
    summary = found.sets[0].transforms
    assert (summary.judged, summary.match) == (2, 0)  # without a calibration nothing is decided
    assert summary.rotation_deg == pytest.approx(np.degrees(0.1))
