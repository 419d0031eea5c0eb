"""`--scheduler` of `enrol` and `identify`: as in this process, though a worker be killed."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from fpmatch.cli.progress import ProgressBars

from .conftest import assert_refused, copied

distributed = pytest.importorskip("distributed", reason="Dask (extra dask) is not installed")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=":0", silence_logs=60
    ) as started:
        yield started.scheduler_address


@pytest.fixture
def killing(cluster, monkeypatch):
    """Kill a worker when two prints are done; return the list of those alive."""
    with distributed.Client(cluster, set_as_default=False) as client:
        alive = sorted(client.run(os.getpid).values())

    def show(self, stage, done, total, text=None):
        if done >= 2 and len(alive) == 2:
            os.kill(alive.pop(), signal.SIGKILL)

    monkeypatch.setattr(ProgressBars, "show", show)
    return alive


@pytest.fixture
def folder(prints, tmp_path):
    """Return a folder of prints under many names, each file different, and one that is broken."""
    folder = copied(prints, tmp_path / "scans", empty="empty.png")
    for k in range(6):
        data = (prints / ("1_1.png", "2_1.png")[k % 2]).read_bytes() + bytes([k])
        (folder / f"{k % 2}_{k}.png").write_bytes(data)
    (folder / "empty.png").rename(folder / "0_9.png")
    return folder


def entries(place):
    with closing(sqlite3.connect(place)) as database:
        return database.execute(
            "SELECT * FROM fpmatch_entry ORDER BY subject, impression"
        ).fetchall()


def test_enrolled_on_a_cluster_a_gallery_is_the_same(run, folder, tmp_path, cluster, killing):
    places = tmp_path / "near.db", tmp_path / "far.db"
    results = [
        run("enrol", place, folder, "--json", *words)
        for place, words in zip(places, (("--workers", 1), ("--scheduler", cluster)), strict=True)
    ]
    near, far = (json.loads(result.stdout) for result in results)
    assert [result.exit_code for result in results] == [1, 1]
    assert len(killing) == 1
    assert (near["enrolled"], near["failures"]) == (far["enrolled"], far["failures"])
    assert far["enrolled"] == 6
    assert entries(places[0]) == entries(places[1])


def test_files_of_candidates_are_the_same(run, folder, gallery, tmp_path, cluster):
    words = ("identify", gallery, "--probes", folder, "-k", 2)
    near = run(*words, "-o", tmp_path / "near.csv", "--workers", 1)
    far = run(*words, "-o", tmp_path / "far.csv", "--scheduler", cluster)
    assert (near.exit_code, far.exit_code, near.stderr) == (1, 1, far.stderr)
    assert (tmp_path / "near.csv").read_bytes() == (tmp_path / "far.csv").read_bytes()


def test_candidates_that_are_shown_are_the_same(run, folder, gallery, cluster):
    words = ("identify", gallery, folder, "-k", 2, "--transform", "--json")
    near, far = (run(*words, *more) for more in (("--workers", 1), ("--scheduler", cluster)))
    assert (near.exit_code, far.exit_code, near.stderr) == (1, 1, far.stderr)
    documents = [json.loads(result.stdout) for result in (near, far)]
    for document in documents:
        assert len(document["probes"]) == 6
        assert all(probe.pop("seconds") >= 0 for probe in document["probes"])
    assert documents[0] == documents[1]


def test_subjects_of_two_fingers_are_the_same(run, prints, gallery, cluster):
    words = ("identify", gallery, prints / "1_1.png", "--with", prints / "2_1.png", "--json")
    near, far = (run(*words, *more) for more in (("--workers", 1), ("--scheduler", cluster)))
    assert (near.exit_code, far.exit_code, near.stderr) == (0, 0, far.stderr)
    documents = [json.loads(result.stdout) for result in (near, far)]
    assert all(document.pop("seconds") >= 0 for document in documents)
    assert documents[0] == documents[1]
    assert documents[0]["candidates"]


def test_workers_need_none_of_the_files(run, folder, gallery, tmp_path, cluster):
    """They are elsewhere: in a folder, and with a name for the files, that they do not have."""
    with distributed.Client(cluster, set_as_default=False) as client:
        client.run(os.chdir, "/")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder.parent)
        words = ("--scheduler", cluster, "--json")
        made = run("enrol", "g.db", folder.name, *words)
        assert json.loads(made.stdout)["enrolled"] == 6
        found = run("identify", "g.db", folder.name, "-o", "c.csv", *words)
    assert json.loads(found.stdout)["failed"] == 1
    assert Path(tmp_path, "c.csv").is_file()


@pytest.mark.parametrize("command", ["enrol", "identify"])
def test_without_a_scheduler_it_is_one_line_and_status_2(
    run, gallery, prints, tmp_path, monkeypatch, command
):
    monkeypatch.setattr("fpmatch.gallery.engine.cluster.CONNECT_S", 0.3)
    place = {"enrol": tmp_path / "new.db", "identify": gallery}[command]
    more = {"enrol": (), "identify": ("-o", tmp_path / "c.csv")}[command]
    words = (command, place, prints / "1_1.png", "--scheduler", "tcp://127.0.0.1:1")
    fused = ("--with", prints / "2_1.png") if command == "identify" else ()
    for each in (words, (*words, *more), (*words, *fused)):
        assert_refused(run(*each), "tcp://127.0.0.1:1: no Dask scheduler answers")
    assert run(*words, "--workers", 2).exit_code == 2
    assert list(tmp_path.iterdir()) == []
