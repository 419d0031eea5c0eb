"""Ctrl-C at any moment: the exit status of an interrupt, no traceback, no process left behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

PRINTS = str(Path(__file__).parents[2] / "sample_data")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals"),
]


@pytest.mark.parametrize("after_s", [0.05, 0.2, 0.5])
@pytest.mark.parametrize(
    "words",
    [
        ["score", "--references", PRINTS, "--probes", PRINTS, "-o", "s.csv", "--workers", "2"],
        ["enrol", "new.db", PRINTS, "--workers", "2"],
    ],
    ids=lambda words: words[0],
)
def test_a_command_ends_at_once_and_says_no_more_than_how_to_resume(
    words, after_s, tmp_path, kernels_line
):
    program = (  # Ctrl-C is ignored in background jobs, as suites may be
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from fpmatch.cli import main; print('there', flush=True); main(prog_name='fpmatch')"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "there\n"
    time.sleep(after_s)
    os.killpg(process.pid, signal.SIGINT)
    # returns once nobody holds the pipes any more: neither the command nor a worker
    output, errors = process.communicate(timeout=60)
    if process.returncode == 0:  # it was done before
        assert output
    else:
        assert process.returncode in {130, -signal.SIGINT}
        how = "fpmatch: note: the same command resumes the run\n"
        assert errors.removeprefix(kernels_line) in {"", how}


@pytest.mark.parametrize("error", ["KeyboardInterrupt", "ValueError"])
def test_an_interrupt_in_a_destructor_is_not_printed_and_another_error_is(error):
    program = f"""
from fpmatch.cli import main
class Destroyed:
    def __del__(self):
        raise {error}
try:
    main(["--version"])
except SystemExit:
    Destroyed()
"""
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert (error in done.stderr) is (error == "ValueError")
