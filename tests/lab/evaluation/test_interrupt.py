"""An interrupted evaluation ends at once, and its workers with it."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

INTERRUPTED = """
import signal
import sys
import fake_bench
from fpmatch.lab.evaluation.run import evaluate
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in a background job
    tell = lambda stage, done, total: print(stage, done, flush=True)
    evaluate(sys.argv[1:], matcher=fake_bench.MATCHER, extractor=fake_bench.slow_extractor,
             workers=2, progress=tell)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
def test_interrupt_ends_parent_and_workers_quickly(make_database, tmp_path):
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED)
    folder = make_database(fingers=20, impressions=8)
    process = subprocess.Popen(
        [sys.executable, script, folder],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    with process:
        for line in process.stdout:
            if not line.startswith("extract 0"):
                break
        os.killpg(process.pid, signal.SIGINT)
        start = time.monotonic()
        # Returns once nobody holds the pipes any more: neither the parent nor a worker.
        _, errors = process.communicate(timeout=30)
    assert time.monotonic() - start < 3
    assert process.returncode != 0
    assert errors.count("Traceback") == 1
    assert errors.rstrip().endswith("KeyboardInterrupt")
