"""`--scheduler` of `enrol`: as in this process, though a worker be killed."""

import json
import sqlite3
from contextlib import closing

import pytest

from fpmatch.cli.progress import ProgressBars
from tests.conftest import copied
from tests.gallery.conftest import kill_one, start_cluster

pytest.importorskip("distributed", reason="Dask (extra dask) is not installed")
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
