"""Nothing is imported from the directory that a command or program is started in."""

import os
import subprocess
import sys

import pytest

MODULES = ["numpy", "cv2", "signal", "selectors", "threadpoolctl", "fpmatch", "anyio"]
PROGRAM = """
from fpmatch.gallery.engine.engine import make_engine

print("started")
with make_engine(2) as engine:
    print(sum(engine.map(max, 0, range(5))))
"""


@pytest.fixture
def hostile(tmp_path):
    """Return a directory with modules that leave a file where they are imported."""
    folder = tmp_path / "here"
    folder.mkdir()
    for name in MODULES:
        (folder / f"{name}.py").write_text(
            f"open({str(tmp_path / 'imported')!r}, 'a').write('{name} ')\nraise ImportError\n"
        )
    return folder


def run(folder, *words):
    """Run Python in a directory, with a path that does not name it."""
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONSAFEPATH"}
    finished = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert not (folder.parent / "imported").exists(), finished.stderr
    assert finished.returncode == 0, finished.stderr
    return finished


def test_workers_of_a_program_import_neither_its_directory_nor_the_program(hostile):
    """A file `numpy.py` is not run, and a script without a main guard is run once."""
    program = hostile.parent / "program.py"
    program.write_text(PROGRAM)
    assert run(hostile, str(program)).stdout == "started\n10\n"


OWN_MATCHER = """
from fpmatch.gallery.engine.engine import make_engine

class Counter:
    def compare(self, probe, reference):
        return min(probe, reference)

def similarity_to_itself(matcher, prepared):
    return matcher.compare(prepared, prepared)

with make_engine(2) as engine:
    print(sum(engine.map(similarity_to_itself, Counter(), range(5))))
"""


def test_work_of_the_script_itself_is_done_in_one_process(tmp_path):
    """It works, and a line says that it is not several processes."""
    script = tmp_path / "program.py"
    script.write_text(OWN_MATCHER)
    finished = run(tmp_path, str(script))
    assert finished.stdout == "10\n", finished.stderr
    assert finished.stderr.count("RuntimeWarning: one process works, not several") == 1
