"""`foreign_minutiae.py` of the benchmarks: rates of folders of CSV minutiae, of own templates."""

import json

import foreign_minutiae
import numpy as np
import pytest
from click.testing import CliRunner

from fpmatch.errors import DatasetError, TemplateError
from fpmatch.templates.minutiae import MinutiaKind

FINGERS, IMPRESSIONS, MINUTIAE = 4, 3, 30


def write_folder(folder, quality=80):
    """Write impressions of a few fingers that differ by a shift and a little jitter."""
    folder.mkdir()
    for finger in range(FINGERS):
        rng = np.random.default_rng(finger)
        xy, theta = rng.uniform(40, 260, (MINUTIAE, 2)), rng.uniform(0, 360, MINUTIAE)
        for number in range(1, IMPRESSIONS + 1):
            shift = np.array([5.0, -3.0]) * number
            moved = xy + shift + rng.normal(0, 1, xy.shape)
            rows = [
                f"{x:.2f},{y:.2f},{angle:.3f},{'EBU'[k % 3]},{quality}"
                for k, ((x, y), angle) in enumerate(zip(moved, theta, strict=True))
            ]
            text = "\n".join(["x,y,theta,type,quality", *rows])
            (folder / f"{101 + finger}_{number}.csv").write_text(f"{text}\n")
    return folder


def run(*words):
    return CliRunner().invoke(foreign_minutiae.main, [*map(str, words), "--workers", "1"])


def test_rates_of_folders_are_printed_and_written(tmp_path):
    one, two = write_folder(tmp_path / "one"), write_folder(tmp_path / "two", quality=0)
    (two / "dataset.toml").write_text("dpi = 569\n")
    done = run(one, two, "--json", tmp_path / "rates.json")
    assert done.exit_code == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines] == ["folder", str(one), str(two), "mean", "pooled"]
    rates = json.loads((tmp_path / "rates.json").read_text())
    assert [row["dpi"] for row in rates["sets"]] == [500, 569]
    for row in rates["sets"]:
        assert (row["genuine"], row["impostor"]) == (FINGERS * 3, 6 * IMPRESSIONS**2)
        assert row["minutiae"] == MINUTIAE
        assert row["eer"] == row["zero_fmr"] == 0.0
        assert row["fmr1000"] is None
    assert rates["mean"]["eer"] == rates["pooled"]["eer"] == 0.0


def test_a_file_is_read_by_its_convention_or_named(tmp_path):
    path, head = tmp_path / "101_1.csv", "x,y,theta,type,quality\n"
    path.write_text(f"{head}10,20,90.0,E,70.6\n30.5,40,350,B,0\n1,2,3,U,9\n")
    template = foreign_minutiae.read_minutiae(path, 569.0)
    m = template.minutiae
    assert m.xy.tolist() == [[10, 20], [30.5, 40], [1, 2]]
    assert np.degrees(m.angle).round(3).tolist() == [90, 350, 3]
    assert m.kind.tolist() == [MinutiaKind.ENDING, MinutiaKind.BIFURCATION, MinutiaKind.OTHER]
    assert m.quality.tolist() == [71, 0, 9]
    assert (template.width, template.height, template.dpi) == (31, 41, 569)
    path.write_text(f"{head}1,2,a,E,5\n")
    with pytest.raises(TemplateError, match=r"101_1.csv.*line 2"):
        foreign_minutiae.read_minutiae(path, 500.0)
    path.write_text(head)
    assert len(foreign_minutiae.read_minutiae(path, 500.0).minutiae) == 0
    resolutions = foreign_minutiae.resolutions
    assert [resolutions(given, 2) for given in ([], [600.0])] == [[None, None], [600, 600]]
    with pytest.raises(DatasetError, match="3 folders"):
        resolutions([500.0, 569.0], 3)


def test_bad_input_is_said_in_one_line(tmp_path):
    for words in ((tmp_path,), (tmp_path / "none",), ("--templates", tmp_path, "--dpi", "500")):
        done = run(*words)
        assert (done.exit_code, done.stdout) == (2, "")
        assert ": error: " in done.stderr
        assert done.stderr.count("\n") == 1
