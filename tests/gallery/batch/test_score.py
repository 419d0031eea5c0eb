"""`fpmatch.gallery.batch.score`: what a run writes, leaves undone, goes on with, and refuses."""

import csv
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fpmatch.errors import MatcherError, OutputError, ScoringError
from fpmatch.gallery.batch.plan import AllPairs
from fpmatch.gallery.batch.score import score
from fpmatch.matching.calibration import Calibration

FOLDER = Path(__file__).parent
sys.path.insert(0, str(FOLDER))

from scoring_fakes import Line, Near  # noqa: E402  (spawned workers must find it by this name)

REFERENCES = Line([0.0, 10.0, 20.0, 30.0, 40.0], "reference")
PROBES = Line([1.0, None, 39.0], "probe")
TEN_A_UNIT = Calibration(((0.0, 0.0), (1.0, 50.0)), tail_scale=1.0)
SMALL_CHUNKS = AllPairs(3, 5, band=2, pairs_per_chunk=2)
NOTED = {"it is far off": ("reference: reference_4", "probe: probe_2")}


def rows(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture
def output(tmp_path):
    return tmp_path / "scores.csv"


def run(output, **options):
    return score(REFERENCES, PROBES, output, **{"matcher": Near(), **options})


def test_a_row_a_pair_probe_by_probe(output):
    output.write_text("old")
    done = run(output, calibration=TEN_A_UNIT)
    written = rows(output)
    assert [(r["probe"], r["reference"]) for r in written] == [
        (p, r) for p in PROBES.names for r in REFERENCES.names
    ]
    assert float(written[1]["similarity"]) == 1 / 10
    assert float(written[1]["score"]) == pytest.approx(5)
    assert (done.pairs, done.rows, done.resumed, done.failed_pairs) == (15, 15, 0, 5)
    assert done.noted == NOTED
    place = ("near", "probe against reference", "probe_1")
    assert [tuple(r.values()) for r in written if r["reason"]] == [
        (*place, name, "", "", "", "inconclusive", "probe: no image, but text", "", "")
        for name in REFERENCES.names
    ]
    (failure,) = done.failures
    assert (failure.side, failure.name) == ("probes", "probe_1")


def test_a_threshold_keeps_candidates_and_what_nobody_knows(output):
    done = run(output, calibration=TEN_A_UNIT, threshold=20)
    assert [(r["probe"], r["reference"]) for r in rows(output)] == [
        ("probe_0", "reference_0"),
        *(("probe_1", name) for name in REFERENCES.names),
        ("probe_2", "reference_4"),
    ]
    assert (done.pairs, done.rows) == (15, 7)


def test_listed_pairs_in_their_order(output, tmp_path):
    listed = tmp_path / "pairs.csv"
    listed.write_text("probe_2,reference_3\nprobe_0,reference_1\n")
    reported = []
    done = run(output, pairs=listed, progress=lambda *state: reported.append(state))
    assert [r["reference"] for r in rows(output)] == ["reference_3", "reference_1"]
    assert (done.probes, done.references, done.failures) == (2, 2, ())
    assert ("probes", 2, 2) in reported


def test_one_folder_on_both_sides_is_read_once(output):
    side, stages = Line([1.0, 7.0, None, 40.0, 41.0]), []
    side.fingers[1] = side.fingers[0]
    done = score(
        side, side, output, matcher=Near(), progress=lambda stage, *_: stages.append(stage)
    )
    assert list(dict.fromkeys(stages)) == ["references", "compare"]
    assert [row["genuine"] for row in rows(output)[:5]] == ["1", "1", "0", "0", "0"]
    assert len(done.failures) == 1
    assert done.dpi_assumed == ("line: line_1",)
    assert done.noted == {"it is far off": ("line: line_3", "line: line_4")}


class Broken(Exception):
    pass


@pytest.fixture
def unfinished(output):
    """Leave a run undone after some of its rows, with half a row too many."""

    def stop(stage, done, total):
        if stage == "compare" and done >= 6:
            raise Broken

    with pytest.raises(Broken):
        go_on(output, progress=stop)
    folder = output.with_name("scores.csv.unfinished")
    with (folder / "rows.csv").open("ab") as stream:
        stream.write(b"probe_2,refer")
    return folder


def go_on(output, **options):
    return run(output, **{"pairs": SMALL_CHUNKS, **options})


def test_an_unfinished_run_goes_on(output, unfinished, tmp_path):
    assert not output.exists()
    done = go_on(output)
    assert (done.resumed, done.noted) == (6, NOTED)
    go_on(tmp_path / "whole.csv")
    assert output.read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert not unfinished.exists()


WORK = """
import sys
from pathlib import Path
sys.path[:0] = sys.argv[2:]
from test_score import Near, go_on
from fpmatch.gallery.batch import unfinished
unfinished.SAVE_EVERY_S = 0  # at each chunk
go_on(Path(sys.argv[1]), matcher=Near(0.005), progress=lambda *_: print("now", flush=True))
"""


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="no signals of POSIX")
def test_killed_at_any_moment_a_run_goes_on(tmp_path, rng):
    """What is on the disk while a process is stopped is what one leaves that is killed."""
    folder, copies = tmp_path / "working", []
    folder.mkdir()
    script = [sys.executable, "-c", WORK, folder / "scores.csv", *sys.path]
    with subprocess.Popen(script, stdout=subprocess.PIPE) as worker:
        for number, _ in enumerate(worker.stdout):
            time.sleep(float(rng.uniform(0.0, 0.005)))
            os.kill(worker.pid, signal.SIGSTOP)
            _, status = os.waitpid(worker.pid, os.WUNTRACED)
            if not os.WIFSTOPPED(status):
                break
            copies.append(shutil.copytree(folder, tmp_path / f"copy {number}"))
            worker.send_signal(signal.SIGCONT)
    done = [go_on(copy / "scores.csv") for copy in copies]
    contents = {(copy / "scores.csv").read_bytes() for copy in copies}
    assert contents == {(folder / "scores.csv").read_bytes()}
    assert {(one.pairs, one.failed_pairs) for one in done} == {(15, 5)}
    assert len({one.resumed for one in done}) > 4
    assert {path.name for copy in copies for path in copy.iterdir()} == {"scores.csv"}


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"matcher": "unit-circle"}, "matcher"),
        ({"calibration": TEN_A_UNIT, "threshold": 3}, "calibration"),
        ({"pairs": AllPairs(3, 5)}, "list of pairs"),
    ],
)
def test_another_run_does_not_go_on_with_it(output, unfinished, options, what):
    with pytest.raises(ScoringError, match=f"an unfinished run, but with another {what}; "):
        go_on(output, **options)
    other = Line([1.0, None, 38.0], "probe")
    with pytest.raises(ScoringError, match="another set of probes"):
        score(REFERENCES, other, output, matcher=Near(), pairs=SMALL_CHUNKS)


@pytest.mark.parametrize("name", ["state.db", "rows.csv"])
def test_a_state_that_is_cut_short_is_refused_in_one_line(output, unfinished, name):
    path = unfinished / name
    path.write_bytes(path.read_bytes()[:40] or b"x" * 40)
    with pytest.raises(ScoringError, match="damaged; delete the folder and start again"):
        go_on(output)


def test_two_runs_do_not_write_one_output(output, unfinished):
    other = sqlite3.connect(unfinished / "state.db")
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(ScoringError, match="another run is writing this output"):
        go_on(output)
    other.close()


def test_a_full_disk_is_one_line_and_the_run_goes_on(output, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("fpmatch.gallery.batch.unfinished.flush", full)
        with pytest.raises(OutputError, match=r"scores.csv: cannot be written: no space left"):
            run(output)
    assert run(output).rows == 15


@pytest.mark.parametrize(
    ("name", "options", "error", "reason"),
    [
        ("scores.txt", {}, OutputError, "scores are written as .csv"),
        ("/dev/null/scores.csv", {}, OutputError, "cannot be written: "),
        ("folder.csv", {}, OutputError, "it is a folder"),
        ("a.csv", {"threshold": 30}, MatcherError, "'near' has no calibration"),
        ("a.csv", {"threshold": 101, "calibration": TEN_A_UNIT}, MatcherError, "in 0..100, not"),
        ("a.csv", {"matcher": "nobody"}, MatcherError, "unknown matcher"),
    ],
)
def test_what_cannot_be_scored(tmp_path, name, options, error, reason):
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(error, match=reason):
        run(tmp_path / name, **options)
    assert [p.name for p in tmp_path.iterdir()] == ["folder.csv"]
