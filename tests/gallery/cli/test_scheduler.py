"""`--scheduler` of `enrol` and `identify`: as in this process, though a worker be killed."""

import json
import os
import re
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from fpmatch.cli.progress import ProgressBars
from tests.conftest import assert_refused, copied
from tests.gallery.conftest import kill_one, start_cluster

distributed = pytest.importorskip("distributed", reason="Dask (extra dask) is not installed")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def cluster():
    with start_cluster() as started:
        yield started.scheduler_address


@pytest.fixture
def killing(cluster, monkeypatch):
    """Kill a worker when two prints are done; return the list of those alive."""
    kill, alive = kill_one(cluster, lambda stage, done, total: done >= 2)
    monkeypatch.setattr(ProgressBars, "show", lambda self, *step: kill(*step))
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


@pytest.mark.parametrize(
    ("words", "status"),
    [
        (("--probes", "{scans}", "-k", 2, "-o", "{out}"), 1),
        (("{scans}", "-k", 2, "--transform", "--json"), 1),
        (("{prints}/1_1.png", "--with", "{prints}/2_1.png", "--json"), 0),
    ],
    ids=["file", "shown", "two fingers"],
)
def test_candidates_are_the_same(run, folder, prints, gallery, tmp_path, cluster, words, status):
    outputs = []
    for number, engine in enumerate((("--workers", 1), ("--scheduler", cluster))):
        out = tmp_path / f"{number}.csv"
        given = [str(word).format(scans=folder, prints=prints, out=out) for word in words]
        done = run("identify", gallery, *given, *engine)
        shown = out.read_text() if out.exists() else re.sub(r'"seconds": [^,}]*', "", done.stdout)
        outputs.append((done.exit_code, done.stderr, shown))
    assert outputs[0] == outputs[1]
    assert outputs[0][0] == status


def test_workers_need_none_of_the_files(run, folder, gallery, tmp_path, cluster):
    """They are elsewhere: in a folder, and with a name for the files, that they do not have."""
    with distributed.Client(cluster, set_as_default=False) as client:
        client.run(os.chdir, "/")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder.parent)
        words = ("--scheduler", cluster, "--json")
        made = run("enrol", "g.db", folder.name, *words)
        searched = run("identify", "g.db", folder.name, "-o", "c.csv", *words)
    assert json.loads(made.stdout)["enrolled"] == 6
    assert json.loads(searched.stdout)["failed"] == 1
    assert Path(tmp_path, "c.csv").is_file()


@pytest.mark.parametrize(
    "words",
    ["enrol {new}", "identify {old}", "identify {old} -o {new}", "identify {old} --with {print}"],
)
def test_without_a_scheduler_it_is_one_line_and_status_2(
    run, gallery, prints, tmp_path, monkeypatch, words
):
    monkeypatch.setattr("fpmatch.gallery.engine.cluster.CONNECT_S", 0.3)
    print_, address = prints / "1_1.png", "tcp://127.0.0.1:1"
    named = {"old": gallery, "print": print_, "new": tmp_path / "new.csv"}
    given = [word.format(**named) for word in words.split()]
    given[2:2] = [print_, "--scheduler", address]
    assert_refused(run(*given), f"{address}: ")
    assert run(*given, "--workers", 2).exit_code == 2
    assert list(tmp_path.iterdir()) == []
