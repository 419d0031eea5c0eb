"""What runs is what was edited, or one line says that it is not.

A student meets it in two ways: a kernel that was edited, and a copy that runs while one stands in a
clone with other sources.
"""

import os
import shutil
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest

from fpmatch.base import kernels

ROOT = Path(__file__).resolve().parents[1]
SUFFIX = EXTENSION_SUFFIXES[0]
PACKAGE = Path(kernels.__file__).parents[1]


@pytest.mark.skipif("FPMATCH_EXPECT_KERNELS" not in os.environ, reason="nobody said how they are")
def test_kernels_are_built_as_expected():
    compiled = os.environ["FPMATCH_EXPECT_KERNELS"] == "compiled"
    assert set(kernels.compiled_kernels().values()) == {compiled}


def test_an_edited_kernel_is_out_of_date_until_it_is_compiled(tmp_path, monkeypatch):
    package = tmp_path / "fpmatch"
    package.mkdir()
    monkeypatch.setattr(kernels, "_PACKAGE", package)

    def outdated_after(second, *names):
        """Return which kernels are out of date once files have been changed at a second."""
        for name in names:
            (package / name).touch()
            os.utime(package / name, (second, second + 0.5))  # a copy may lose parts of a second
        return kernels.outdated_kernels()

    both = ["fpmatch._a_kernel", "fpmatch._b_kernel"]
    a, b = (f"_{letter}_kernel{SUFFIX}" for letter in "ab")
    outdated_after(100, "_a_kernel.py", "_b_kernel.py", "_a_kernel.pxd")
    assert outdated_after(200, a, b) == []  # there is no scripts/build, so it is no clone
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "build").touch()
    assert outdated_after(300, "_a_kernel.py") == both[:1]
    assert outdated_after(300, a) == []
    assert outdated_after(400, "_a_kernel.pxd") == both
    assert outdated_after(400, a, b) == []
    (package / b).unlink()
    assert outdated_after(400) == both[1:]
    (package / a).unlink()
    assert outdated_after(400) == []  # none is compiled, on purpose


def test_a_command_in_a_clone_notes_that_it_runs_other_sources(tmp_path, run, monkeypatch):
    """From any folder of the clone; not elsewhere, and not where the sources are the same."""
    clone = tmp_path / "clone"
    shutil.copytree(PACKAGE, clone / "fpmatch")
    (clone / "scripts").mkdir()
    (clone / "scripts" / "build").touch()
    monkeypatch.chdir(clone / "scripts")
    assert kernels.other_sources_note() is None
    (clone / "fpmatch" / "new.py").touch()
    (note,) = run("verify", "--help").stderr.splitlines()
    assert note.startswith(f"fpmatch: note: this is the fpmatch of {PACKAGE.parent}, not ")
    assert f" {clone}, " in note
    for folder in (tmp_path, ROOT / "docs"):
        monkeypatch.chdir(folder)
        assert kernels.other_sources_note() is None
