"""What the tests of engines share: engines of each kind, clusters, and `chunk_work` for workers."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fpmatch.gallery.engine.engine import make_engine

FOLDER = str(Path(__file__).parent)
sys.path.insert(0, FOLDER)
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}


@pytest.fixture(autouse=True, scope="module")
def workers_find_the_work():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", ENVIRONMENT["PYTHONPATH"])
        yield


@pytest.fixture
def scheduler(local_cluster):
    return local_cluster.scheduler_address


@pytest.fixture(params=["serial", "processes", pytest.param("dask", marks=pytest.mark.slow)])
def engine(request):
    scheduler = request.getfixturevalue("scheduler") if request.param == "dask" else None
    workers = {"serial": 1, "processes": 2, "dask": None}[request.param]
    with make_engine(workers, scheduler) as made:
        yield made


_CLUSTER = """
import sys, time, distributed
cluster = distributed.LocalCluster(
    n_workers=1, threads_per_worker=1, processes=False, host="127.0.0.1", protocol="tcp://",
    dashboard_address=":0", silence_logs=60,
)
if len(sys.argv) > 1:  # a worker that cannot import fpmatch
    sys.modules["fpmatch"] = None
print(cluster.scheduler_address, flush=True)
time.sleep(60)
"""


@pytest.fixture
def other_cluster():
    """Return a function that starts a cluster in a process of its own: its address, the process."""
    started = []

    def start(*words):
        process = subprocess.Popen(
            [sys.executable, "-c", _CLUSTER, *words],
            env=ENVIRONMENT,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        started.append(process)
        return process.stdout.readline().strip(), process

    yield start
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()
