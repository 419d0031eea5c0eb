"""The core without wings: its commands work, and those of a wing say what is missing."""

import subprocess
import sys
from pathlib import Path

import pytest

WINGS = ("gallery", "server", "lab")
SAMPLES = Path(__file__).parents[2] / "sample_data"
WITHOUT = f"""
import sys

class NoWings:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name.split(".")[1:2] in {[[wing] for wing in WINGS]}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, NoWings)
from fpmatch.cli import main
main(sys.argv[1:], prog_name="fpmatch")
"""


@pytest.fixture
def without_wings(tmp_path):
    """Return a function that runs a command in a process where no wing can be imported."""

    def run_words(*words):
        command = [sys.executable, "-c", WITHOUT, *map(str, words)]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)

    return run_words


def test_the_commands_of_the_core_need_no_wing(without_wings, tmp_path):
    prints = [SAMPLES / f"101_{n}.tif" for n in (1, 3)]
    for words in (
        ("verify", *prints, "--json", "--overlay", "o.png", "--case-report", "case.html"),
        ("verify", *prints, "--overlay", "o.svg"),
        ("extract", prints[0], "-o", "templates"),
        ("convert", "templates/101_1.json", "101_1.iso"),
        ("inspect", prints[0], "101_1.iso"),
        ("extract", prints[0], "-o", "stages", "--format", "stages"),
    ):
        done = without_wings(*words)
        assert (done.returncode, done.stderr) == (0, ""), words
    assert {"o.png", "o.svg", "case.html", "101_1.iso"} <= {
        path.name for path in tmp_path.iterdir()
    }


@pytest.mark.parametrize(
    ("words", "needed"),
    [
        ("identify", "'identify' needs the package fpmatch.gallery"),
        ("serve", "'serve' needs the package fpmatch.server"),
        ("points", "'points' needs the package fpmatch.lab"),
        ("verify 1.tif --gallery g.db --subject 1", "'verify --gallery' needs the package fpmatch"),
        ("extract --gallery g.db -o out", "'extract --gallery' needs the package fpmatch.gallery"),
    ],
)
def test_what_needs_a_wing_names_it_where_it_is_missing(without_wings, words, needed):
    done = without_wings(*words.split())
    assert (done.returncode, done.stdout) == (2, "")
    assert needed in done.stderr.splitlines()[-1]
