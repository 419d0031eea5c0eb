"""What runs is what was edited: `scripts/build` compiles it, and else one line says so.

A student meets it in three ways: a kernel that was edited, a copy that `pip install .` put in the
place of an editable install, and a copy that runs while one stands in a clone with other sources.
"""

import os
import shutil
import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest

from fpmatch.base import kernels

ROOT = Path(__file__).resolve().parents[1]
SUFFIX = EXTENSION_SUFFIXES[0]
BASH = shutil.which("bash")
COMPILER = shutil.which("cc") or shutil.which("gcc")
PACKAGE = Path(kernels.__file__).parents[1]


def needs_compiler(test):
    reason = "no bash, or no C compiler"
    return pytest.mark.slow(pytest.mark.skipif(not (BASH and COMPILER), reason=reason)(test))


@pytest.mark.skipif("FPMATCH_EXPECT_KERNELS" not in os.environ, reason="nobody said how they are")
def test_kernels_are_built_as_expected():
    compiled = os.environ["FPMATCH_EXPECT_KERNELS"] == "compiled"
    assert set(kernels.compiled_kernels().values()) == {compiled}


@pytest.fixture
def package(tmp_path):
    """Return the package of a source tree with two kernels, of which one uses the other."""
    package = tmp_path / "tree" / "fpmatch"
    (package / "base").mkdir(parents=True)
    shutil.copy(kernels.__file__, package / "base")
    (package / "__init__.py").touch()
    (package / "base" / "__init__.py").touch()
    (package / "__main__.py").write_text(
        "from fpmatch.base.kernels import other_sources_note, outdated_kernels\n"
        "print(other_sources_note() or len(outdated_kernels()))\n"
    )
    (package / "_base_kernel.py").write_text("def base():\n    return 1\n")
    (package / "_base_kernel.pxd").write_text("cpdef long base()\n")
    (package / "_sum_kernel.py").write_text(
        "import cython\n\nif cython.compiled:\n"
        "    from cython.cimports.fpmatch import _base_kernel as other\n"
        "else:\n    from fpmatch import _base_kernel as other\n\n\n"
        "def total():\n    return 10 + other.base()\n"
    )
    scripts = package.parent / "scripts"
    scripts.mkdir()
    for name in ("build", "venv.sh"):
        shutil.copy(ROOT / "scripts" / name, scripts)
    return package


PROJECT = """
[build-system]
requires = ["setuptools", "Cython"]
build-backend = "setuptools.build_meta"

[project]
name = "fpmatch"
version = "0"

[tool.setuptools.packages.find]
include = ["fpmatch*"]
"""
# As the scripts call pip, without a network: what is to be built with is there.
OFFLINE = {"PIP_NO_INDEX": "1", "PIP_NO_DEPS": "1", "PIP_NO_BUILD_ISOLATION": "0"}


@pytest.fixture
def build(package):
    """Return a function that runs `scripts/build` in that tree, in an environment of its own.

    The environment has the packages of this one, and the tree in the place of an editable install.
    """
    for name in ("setuptools", "pip", "Cython"):
        pytest.importorskip(name, reason=f"{name} is not installed")
    tree = package.parent
    shutil.copy(ROOT / "setup.py", tree)
    (tree / "pyproject.toml").write_text(PROJECT)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tree / ".venv"], check=True)
    packages = next((tree / ".venv").glob("[Ll]ib/**/site-packages"))
    (packages / "__editable__.pth").write_text(f"{tree}\n")
    (packages / "others.pth").write_text(f"{Path(pytest.__file__).parents[1]}\n")
    compiler = tree / "compiler"  # which takes no time to optimize
    compiler.write_text(f'#!/bin/sh\nexec {COMPILER} "$@" -O0\n')
    compiler.chmod(0o755)
    installed = "source scripts/venv.sh; fingerprint pyproject.toml >.venv/.fpmatch-dev"
    subprocess.run([str(BASH), "-c", installed], cwd=tree, check=True)

    def run(**environment):
        words = [str(BASH), "scripts/build"]
        environment = {**os.environ, **OFFLINE, "CC": str(compiler), **environment}
        return subprocess.run(
            words, cwd=tree, env=environment, capture_output=True, text=True, check=False
        )

    return run


def printed(package, *words):
    """Return what a new process prints in the tree, by the Python of the environment there."""
    command = [package.parent / ".venv" / "bin" / "python", *words]
    done = subprocess.run(command, cwd=package.parent, capture_output=True, text=True, check=True)
    return done.stdout


def age(folder):
    """Let all files be an hour older, as if the time of an edit were now."""
    for path in folder.rglob("*"):
        if path.is_file() and not path.is_symlink():
            os.utime(path, (path.stat().st_mtime - 3600,) * 2)


TOTAL = "from fpmatch import _sum_kernel as k; print(k.__file__, k.total())"
FRESH = "0\n"


@needs_compiler
def test_an_edited_kernel_is_out_of_date_until_it_is_built(package, build):
    first = build()
    assert (first.returncode, first.stdout) == (0, FRESH), first.stderr
    assert printed(package, "-c", TOTAL).split()[1] == "11"
    user = package / f"_sum_kernel{SUFFIX}"
    for name, old, new, stale, total in (
        ("_base_kernel.py", "1", "2", 1, "12"),
        ("_base_kernel.pxd", "long", "int", 2, "12"),
    ):
        age(package.parent)
        before = user.stat().st_mtime
        (package / name).write_text((package / name).read_text().replace(old, new))
        assert printed(package, "-m", "fpmatch") == f"{stale}\n"
        assert build().stdout == FRESH
        assert printed(package, "-c", TOTAL).split()[1] == total
        assert (user.stat().st_mtime > before) == (stale == 2)
    user.unlink()
    assert printed(package, "-m", "fpmatch") == "1\n"
    (package / f"_base_kernel{SUFFIX}").unlink()
    assert printed(package, "-m", "fpmatch") == FRESH


@needs_compiler
def test_build_replaces_a_copy_that_pip_has_put_in_the_place_of_the_clone(package, build):
    assert build().returncode == 0
    next(package.parent.glob(".venv/[Ll]ib/**/__editable__.pth")).unlink()
    environment = {**os.environ, **OFFLINE, "FPMATCH_NO_COMPILE": "1"}
    installs = [package.parent / ".venv/bin/python", "-m", "pip", "install", "--quiet", "."]
    subprocess.run(installs, cwd=package.parent, env=environment, check=True)
    assert "site-packages" in printed(package, "-P", "-c", TOTAL)

    source = package / "_base_kernel.py"
    source.write_text(source.read_text().replace("1", "2"))
    assert f"not that of the clone {package.parent}" in printed(package, "-P", "-m", "fpmatch")
    done = build()
    assert (done.returncode, done.stdout) == (0, FRESH), done.stderr
    assert "a copy" in done.stderr
    file, total = printed(package, "-P", "-c", TOTAL).split()
    assert (file, total) == (str(package / f"_sum_kernel{SUFFIX}"), "12")
    assert "a copy" not in build().stderr


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


@needs_compiler
@pytest.mark.parametrize(
    ("source", "environment", "reasons"),
    [
        ("def total(:\n", {}, ("_sum_kernel.py:1:10", "build/kernels.log")),
        ("", {"CC": "no-such-compiler -O2"}, ("no-such-compiler", "CC=")),
    ],
)
def test_build_says_why_it_compiles_nothing(package, build, source, environment, reasons):
    (package / "_sum_kernel.py").write_text(source)
    refused = build(**environment)
    assert (refused.returncode, refused.stdout) == (1, "")
    assert all(reason in refused.stderr for reason in reasons)
