import json
import re
import shutil

import numpy as np
import pytest

from fpmatch.formats.files import save_template
from fpmatch.templates.minutiae import Minutiae, Template


@pytest.fixture
def evaluate(run):
    """Return a function that runs the command, on one process."""
    return lambda *words: run("evaluate-identification", "--workers", 1, *words)


@pytest.fixture
def searched(tmp_path):
    """Return a folder of templates of six fingers, four of each, one of which is broken."""
    folder = tmp_path / "searched"
    folder.mkdir()
    for finger in range(1, 7):
        place = np.random.default_rng(finger).uniform(20, 280, (2, 15))
        for impression in range(1, 5):
            noise = np.random.default_rng([finger, impression]).normal(0, 2, (2, 15))
            x, y = place + noise
            template = Template(Minutiae(x, y, np.linspace(0, 6, 15)), 300, 300)
            save_template(folder / f"{finger}_{impression}.xyt", template)
    (folder / "3_3.xyt").write_text("broken")
    return folder


def test_identification_with_one_and_two_fingers(evaluate, searched, tmp_path):
    words = (searched, "--fpir", "0.1", "--fpir", "0.2")
    outputs = ("--curves", tmp_path / "curves", "--det", tmp_path / "det.svg")
    result = evaluate(*words, "--fingers", 2, *outputs)
    assert result.exit_code == 1, result.output
    one, rates, _, _, two, *_ = result.stdout.split("\n\n")
    assert (one[0], two[0]) == ("1", "2")
    assert rates.splitlines()[1].split()[:3] == ["searched", "72", "144"]
    assert "no template" in result.stderr
    head, *rows = (tmp_path / "curves" / "identification_rank.csv").read_text().splitlines()
    assert head == "matcher,set,fingers,rank,fnir,fnir_low,fnir_high"
    assert len(rows) == 200
    assert (tmp_path / "curves" / "identification_det.csv").exists()
    assert "FPIR, %" in (tmp_path / "det.svg").read_text()
    document = json.loads(evaluate(*words, "--json").stdout)
    assert document["protocol"] == "identification"
    (test,) = document["tests"]
    assert [p["fpir"] for p in test["sets"][0]["fnir_at_fpir"]] == [0.1, 0.2]
    assert test["pooled"]["mated"] == 72


def test_a_page_lists_the_searches_that_fail(evaluate, searched, tmp_path):
    pytest.importorskip("matplotlib")
    (tmp_path / "others").mkdir()
    for name in ("3_1.xyt", "4_1.xyt"):  # which searches for the same prints return
        shutil.copy(searched / name, tmp_path / "others")
    words = (searched, "--background", tmp_path / "others", "--fingers", 2, "--fpir", "0.1")
    words = (*words, "--report")
    result = evaluate(*words, tmp_path / "out")
    assert result.exit_code == 1, result.output
    page = (tmp_path / "out" / "identification.html").read_text(encoding="utf-8")
    assert "http" not in re.sub(r'xmlns(:xlink)?="[^"]*"', "", page)
    assert page.count("<svg") == 2
    assert "Searches that fail at an FPIR of 10 %" in page
    assert page.count("overlay of searched: ") > 1
    assert "3_3.xyt" in page
    assert "a print of the background" in page
    assert ", beyond 2</td>" in page
    (tmp_path / "file").touch()
    refused = evaluate(*words, tmp_path / "file")
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert str(tmp_path / "file") in refused.stderr
