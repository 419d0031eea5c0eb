"""Compiled kernels state what they were compiled from; `scripts/build` compiles what changed.

What runs is what was edited: of the clone, or a note says that it is a copy.
"""

import importlib
import importlib.util
import os
import shutil
import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest

from fpmatch.base import kernels
from tests.conftest import called_kernels, kernels_of

ROOT = Path(__file__).resolve().parents[1]
SUFFIX = EXTENSION_SUFFIXES[0]
BASH = shutil.which("bash")
COMPILER = shutil.which("cc") or shutil.which("gcc")
PACKAGE = Path(kernels.__file__).parents[1]
KERNELS = sorted(PACKAGE.rglob("_*_kernel.py"))


@pytest.mark.skipif(
    "FPMATCH_EXPECT_KERNELS" not in os.environ, reason="nobody said how the kernels are built"
)
def test_kernels_are_built_as_expected():
    suffixes = (SUFFIX,) if os.environ["FPMATCH_EXPECT_KERNELS"] == "compiled" else (".py",)
    assert KERNELS
    for kernel in KERNELS:
        name = ".".join(["fpmatch", *kernel.relative_to(PACKAGE).with_suffix("").parts])
        assert str(importlib.import_module(name).__file__).endswith(suffixes), name


def test_each_kernel_has_tests_that_run_where_it_is_interpreted():
    """Files that name it, a module or a kernel that calls it: `tests/conftest.py` marks them."""
    tested = set().union(*map(kernels_of, ROOT.glob("tests/**/test_*.py")))
    called = {name.rpartition(".")[2]: kernels for name, kernels in called_kernels().items()}
    tested |= set().union(*(called.get(name, set()) for name in tested))
    assert {kernel.stem for kernel in KERNELS} <= tested


@pytest.fixture
def package(tmp_path):
    """Return the package of a source tree with two kernels; the first uses a file of the other."""
    package = tmp_path / "tree" / "fpmatch"
    (package / "base").mkdir(parents=True)
    shutil.copy(kernels.__file__, package / "base")
    (package / "__init__.py").touch()
    (package / "base" / "__init__.py").touch()
    (package / "__main__.py").write_text(
        "from fpmatch.base.kernels import kernels_text\nprint(kernels_text())\n"
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


@pytest.fixture
def outdated(package):
    """Return the function that lists the kernels out of date of that package."""
    spec = importlib.util.spec_from_file_location(
        "kernels_of_a_tree", package / "base" / "kernels.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.outdated_kernels


def pretend_to_compile(package, name, *used):
    """Write a file that states what a kernel was compiled from, as a compiled one does."""
    files = [package / one for one in (f"{name}.py", f"{name}.pxd", *used)]
    statement = kernels.sources_statement(files, package).encode()
    (package / f"{name}{SUFFIX}").write_bytes(b"\x7fELF\0" * 99 + statement + b"\0end\0")


@pytest.fixture
def compiled(package):
    pretend_to_compile(package, "_base_kernel")
    pretend_to_compile(package, "_sum_kernel", "_base_kernel.pxd")


BASE, USER = "fpmatch._base_kernel", "fpmatch._sum_kernel"


@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize(
    ("changed", "names"),
    [
        ("_sum_kernel.py", [USER]),
        ("_base_kernel.py", [BASE]),
        ("_base_kernel.pxd", [BASE, USER]),
        ("_sum_kernel.pxd", [USER]),  # which is new
    ],
)
def test_a_change_of_any_source_is_seen_whatever_its_time(package, outdated, changed, names):
    assert outdated() == []
    with (package / changed).open("a") as file:
        file.write("# another line\n")
    os.utime(package / changed, (0, 0))
    assert outdated() == names


@pytest.mark.usefixtures("compiled")
def test_files_that_are_gone_or_state_nothing_are_seen(package, outdated):
    (package / f"_sum_kernel{SUFFIX}").write_bytes(b"\x7fELF of an earlier version")
    assert outdated() == [USER]
    (package / f"_sum_kernel{SUFFIX}").unlink()
    assert outdated() == [USER]
    (package / "_base_kernel.pxd").unlink()
    assert outdated() == [BASE, USER]
    (package.parent / "scripts" / "build").unlink()  # no source tree: it may be interpreted
    assert outdated() == [BASE]


def test_no_kernel_is_out_of_date_where_none_is_compiled(outdated):
    assert outdated() == []


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


def total(package):
    """Return what the second kernel computes, compiled, in a new process."""
    code = "from fpmatch import _sum_kernel as k; print(k.total() * (k.__file__[-3:] != '.py'))"
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, cwd=package.parent, capture_output=True, text=True, check=True)
    return int(done.stdout)


@pytest.mark.slow
@pytest.mark.skipif(not (BASH and COMPILER), reason="no bash, or no C compiler")
def test_build_compiles_what_changed_and_nothing_else(package, outdated, build):
    first = build()
    assert (first.returncode, first.stdout) == (0, "kernels compiled\n"), first.stderr
    assert total(package) == 11
    base, user = (package / f"_{name}_kernel{SUFFIX}" for name in ("base", "sum"))
    compiled = user.stat().st_mtime_ns

    source = package / "_base_kernel.py"
    source.write_text(source.read_text().replace("1", "2"))
    os.utime(source, (0, 0))
    user.write_bytes(b"\x7fELF of another version, newer than what was built")
    assert outdated() == [BASE, USER]
    assert build().stdout == "kernels compiled\n"
    assert (outdated(), total(package)) == ([], 12)
    assert user.stat().st_mtime_ns == compiled < base.stat().st_mtime_ns

    (package / "_base_kernel.pxd").write_text("cpdef int base()\n")
    assert outdated() == [BASE, USER]
    assert build().stdout == "kernels compiled\n"
    assert (outdated(), total(package)) == ([], 12)
    assert user.stat().st_mtime_ns > compiled


@pytest.mark.slow
@pytest.mark.skipif(not (BASH and COMPILER), reason="no bash, or no C compiler")
def test_build_replaces_a_copy_that_pip_has_put_in_the_place_of_the_clone(package, build):
    """After `pip install .` in a clone; what runs anywhere is the kernel that was edited."""
    assert build().returncode == 0
    tree = package.parent
    python = tree / ".venv" / "bin" / "python"
    next(tree.glob(".venv/[Ll]ib/**/__editable__.pth")).unlink()
    environment = {**os.environ, **OFFLINE, "FPMATCH_NO_COMPILE": "1"}
    installs = [python, "-m", "pip", "install", "--quiet", "."]
    subprocess.run(installs, cwd=tree, env=environment, check=True)
    code = "from fpmatch import _sum_kernel as k; print(k.__file__, k.total())"
    runs = [python, "-P", "-c", code]
    copied = subprocess.run(runs, cwd=tree, capture_output=True, text=True, check=True).stdout
    assert "site-packages" in copied

    source = package / "_base_kernel.py"
    source.write_text(source.read_text().replace("1", "2"))
    done = build()
    assert (done.returncode, done.stdout) == (0, "kernels compiled\n"), done.stderr
    assert "a copy" in done.stderr
    edited = subprocess.run(runs, cwd=tree, capture_output=True, text=True, check=True).stdout
    assert edited.split() == [str(package / f"_sum_kernel{SUFFIX}"), "12"]
    assert "a copy" not in build().stderr


@pytest.fixture
def clone(tmp_path):
    """Return a clone with another matcher than the package that is installed."""
    shutil.copytree(PACKAGE, tmp_path / "clone" / "fpmatch")
    (tmp_path / "clone" / "scripts").mkdir()
    (tmp_path / "clone" / "scripts" / "build").touch()
    matcher = tmp_path / "clone" / "fpmatch" / "matching" / "matchers" / "paper.py"
    changed = matcher.read_text().replace("=match.matched_share", "=match.matched_share / 2")
    assert changed != matcher.read_text()
    matcher.write_text(changed)
    return tmp_path / "clone"


def test_a_command_in_a_clone_notes_that_it_runs_other_sources(clone, tmp_path, run, monkeypatch):
    """Once, from any folder of the clone; not elsewhere, and not where the sources are the same."""
    (clone / "work").mkdir()
    for folder in (clone, clone / "work"):
        monkeypatch.chdir(folder)
        for command in (["verify", "--help"], ["--version"]):
            (note,) = run(*command).stderr.splitlines()
            assert note.startswith(f"fpmatch: note: this is the fpmatch of {PACKAGE.parent}, not ")
            assert f" {clone}, " in note
            assert "`pip install --no-deps --editable .`" in note
        assert run("doctor").stderr.startswith(note)
    shutil.copy(PACKAGE / "matching" / "matchers" / "paper.py", clone / "fpmatch/matching/matchers")
    assert kernels.other_sources_note() is None
    (clone / "fpmatch" / "new.py").touch()
    assert str(clone) in kernels.other_sources_note()
    for folder in (tmp_path, ROOT / "docs"):
        monkeypatch.chdir(folder)
        assert kernels.other_sources_note() is None


@pytest.mark.slow
def test_one_worker_and_several_run_the_same_code_of_a_clone(clone, tmp_path):
    """By `python -m fpmatch` in a clone, where another copy is installed."""
    prints = [shutil.copy(path, tmp_path) for path in sorted(ROOT.glob("sample_data/101_?.tif"))]
    assert len(prints) == 4

    def scores(*options):
        words = ["score", "--references", tmp_path, "--probes", tmp_path, "--matcher", "paper"]
        command = [sys.executable, *options[:-1], "-m", "fpmatch", *words, "--workers", options[-1]]
        output = tmp_path / f"{'_'.join(options)}.csv"
        subprocess.run([*command, "-o", output], cwd=clone, check=True, capture_output=True)
        return output.read_text()

    assert scores("1") == scores("2") != scores("-P", "1") == scores("-P", "2")


@pytest.mark.skipif(not BASH, reason="no bash")
def test_build_says_that_there_is_no_compiler(package, build):
    refused = build(CC="no-such-compiler -O2")
    assert (refused.returncode, refused.stdout) == (1, "")
    reason, remedy = refused.stderr.splitlines()
    assert "no-such-compiler" in reason
    assert "CC=" in remedy
    assert not list(package.rglob(f"*{SUFFIX}"))


@pytest.mark.slow
@pytest.mark.skipif(not (BASH and COMPILER), reason="no bash, or no C compiler")
def test_build_shows_why_a_kernel_cannot_be_compiled(package, build):
    (package / "_sum_kernel.py").write_text("def total(:\n")
    failed = build()
    assert failed.returncode == 1
    assert "_sum_kernel.py:1:10" in failed.stderr
    assert "build/kernels.log" in failed.stderr
