"""`fpmatch.evaluation.batch.score` on every engine: the same bytes, though a worker be killed."""

import importlib.util
import os
import signal
import sys
from pathlib import Path

import pytest

from fpmatch.evaluation.batch.plan import AllPairs
from fpmatch.evaluation.batch.score import score
from fpmatch.gallery.engine.engine import dask, processes

FOLDER = Path(__file__).parent
sys.path.insert(0, str(FOLDER))

from scoring_fakes import Line, Near  # noqa: E402  (spawned workers must find it by this name)

needs_dask = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None, reason="Dask (extra dask) is not installed"
)
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


@needs_dask
@pytest.mark.slow
def test_a_cluster_of_which_a_worker_is_killed(tmp_path, expected):
    import distributed

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=":0", silence_logs=60
    ) as cluster:
        address = cluster.scheduler_address
        assert run(tmp_path / "calm.csv", dask(address)) == expected
        with distributed.Client(address, set_as_default=False) as client:
            alive = sorted(client.run(os.getpid).values())

            def kill(stage, done, total):
                if stage == "compare" and done > total // 4 and len(alive) == 2:
                    os.kill(alive.pop(), signal.SIGKILL)

            assert run(tmp_path / "killed.csv", dask(address), progress=kill) == expected
            assert len(alive) == 1
