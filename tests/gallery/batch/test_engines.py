"""`fpmatch.gallery.batch.score` on every engine: the same bytes, though a worker be killed."""

import sys
from pathlib import Path

import pytest

from fpmatch.gallery.batch.plan import AllPairs
from fpmatch.gallery.batch.score import score
from fpmatch.gallery.engine.engine import dask, processes
from tests.gallery.conftest import kill_one

FOLDER = Path(__file__).parent
sys.path.insert(0, str(FOLDER))

from scoring_fakes import Line, Near  # noqa: E402  (spawned workers must find it by this name)

REFERENCES = Line([3.0 * n for n in range(20)], "reference")
PROBES = Line([5.0, None, 8.5, 20.0], "probe")
PLAN = AllPairs(4, 20, band=4, pairs_per_chunk=4)


def run(output, engine=None, **options):
    score(REFERENCES, PROBES, output, pairs=PLAN, matcher=Near(0.002), engine=engine, **options)
    return output.read_bytes()


@pytest.fixture
def expected(tmp_path):
    return run(tmp_path / "expected.csv")


@pytest.fixture(autouse=True)
def workers_find_the_fakes(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(FOLDER))


def test_several_processes(tmp_path, expected):
    assert run(tmp_path / "scores.csv", processes(2)) == expected


@pytest.mark.slow
def test_a_cluster_of_which_a_worker_is_killed(tmp_path, expected, local_cluster):
    address = local_cluster.scheduler_address
    assert run(tmp_path / "calm.csv", dask(address)) == expected
    kill, alive = kill_one(address, lambda stage, n, total: stage == "compare" and n > total // 4)
    assert run(tmp_path / "killed.csv", dask(address), progress=kill) == expected
    assert len(alive) == 1
