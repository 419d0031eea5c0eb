import json

import numpy as np
import pytest

from tests.conftest import assert_refused


def test_scores_of_other_matchers_stand_side_by_side(run, tmp_path):
    rng = np.random.default_rng(4)
    for name, shift in (("good", 3.0), ("poor", 1.0)):
        lines = [
            f"{a // 4}_{a},{b // 4}_{b},{rng.normal(shift * (a // 4 == b // 4), 1):.6f}\n"
            for a in range(32)
            for b in range(a)
        ]
        (tmp_path / f"{name}.txt").write_text("probe,reference,score\n" + "".join(lines))
    files = (tmp_path / "good.txt", tmp_path / "poor.txt")
    result = run("rates", *files, "--bootstrap", 100)
    assert result.exit_code == 0
    assert "poor compared with good: 496 pairs" in result.stdout
    document = json.loads(run("rates", *files, "--bootstrap", 0, "--json").stdout)
    eers = [one["pooled"]["eer"] for one in document["matchers"]]
    assert eers[0] < eers[1]
    assert "lower" in run("rates", *files, "--distances").stderr
    assert_refused(run("rates", *files, tmp_path / "good.txt"), "same name: good")


def test_a_report_of_scores_names_the_hardest_pairs_where_they_have_names(run, tmp_path):
    pytest.importorskip("matplotlib")
    path, page = tmp_path / "theirs.csv", tmp_path / "report" / "index.html"
    for text, shown in (
        ("probe,reference,genuine,score\nann<1>,ann 2,1,0.9\nann<1>,bob,0,0.1\n", True),
        ("score\n0.9\n", False),
    ):
        path.write_text(text)
        kinds = ["--genuine-scores", path, "--impostor-scores", path]
        given = [path] if shown else kinds
        assert run("rates", *given, "--report", page.parent).exit_code == 0
        assert ("ann&lt;1&gt; and ann 2" in page.read_text(encoding="utf-8")) == shown


def test_a_full_disk_does_not_cost_the_rates(run, tmp_path, tiny_disk):
    path = tmp_path / "x.csv"
    path.write_text("probe,reference,score\n1_1,1_2,9\n1_1,2_1,1\n")
    (tiny_disk / "fill").write_bytes(bytes(61_440))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fpmatch.lab.evaluation.report.text.csv_lines", lambda rows: bytes(9000))
        result = run("rates", path, "--table", tiny_disk / "a.csv")
    assert result.exit_code == 2
    assert result.stdout == run("rates", path).stdout != ""
    line = f"{tiny_disk / 'a.csv'}: cannot be written: no space left on device"
    assert result.stderr.splitlines()[-1] == f"fpmatch: error: {line}"
    assert [path.name for path in tiny_disk.iterdir()] == ["fill"]


@pytest.mark.parametrize(("kind", "other"), [("impostor", "1_2"), ("genuine", "2_1")])
def test_a_missing_kind_of_pairs_is_named(run, tmp_path, kind, other):
    (tmp_path / "mine.csv").write_text(f"probe,reference,score\n1_1,{other},3\n")
    assert f"mine: no {kind} pairs" in run("rates", tmp_path / "mine.csv").stderr
