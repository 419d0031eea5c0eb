"""`--scheduler` of `enrol`: as in this process, though a worker be killed."""

import json
import os
import signal
import sqlite3
from contextlib import closing

import pytest

from fpmatch.cli.progress import ProgressBars
from tests.conftest import copied

distributed = pytest.importorskip("distributed", reason="Dask (extra dask) is not installed")


def entries(place):
    statement = "SELECT * FROM fpmatch_entry ORDER BY subject, impression"
    with closing(sqlite3.connect(place)) as database:
        return database.execute(statement).fetchall()


@pytest.mark.slow
def test_enrolled_on_a_cluster_a_gallery_is_the_same(
    run, prints, tmp_path, local_cluster, monkeypatch
):
    """Of prints under many names, each file different, and one that is broken."""
    folder = copied(prints, tmp_path / "scans", _0_9="empty.png")
    for k in range(6):
        data = (prints / ("1_1.png", "2_1.png")[k % 2]).read_bytes() + bytes([k])
        (folder / f"{k % 2}_{k}.png").write_bytes(data)
    address = local_cluster.scheduler_address
    with distributed.Client(address, set_as_default=False) as client:
        alive = list(client.run(os.getpid).values())

    def kill_one(bars, stage, done, total):
        if len(alive) == 2 and done >= 2:
            os.kill(alive.pop(), signal.SIGKILL)

    monkeypatch.setattr(ProgressBars, "show", kill_one)
    found = []
    for name, words in (("far", ("--scheduler", address)), ("near", ("--workers", 1))):
        result = run("enrol", tmp_path / name, folder, "--json", *words)
        document = json.loads(result.stdout)
        outcome = result.exit_code, document["enrolled"], document["failures"]
        found.append((*outcome, entries(tmp_path / name)))
    assert (len(alive), found[0][:2]) == (1, (1, 6))
    assert found[0] == found[1]
