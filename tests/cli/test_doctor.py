"""`fpmatch doctor` and `--version`: what is installed, and whether the kernels are compiled."""

import importlib
import json
import re
from importlib.metadata import PackageNotFoundError

import pytest

import fpmatch
from fpmatch import installation, kernels
from fpmatch.engine.local import available_cores
from fpmatch.matching.pipeline._kernels._local_kernel import COMPILED


def test_kernels_are_compiled_where_they_are_loaded_so():
    found = kernels.compiled_kernels()
    assert len(found) > 20
    assert set(found.values()) == {COMPILED}
    for name, compiled in found.items():
        assert str(importlib.import_module(name).__file__).endswith(".py") is not compiled


@pytest.mark.parametrize(
    ("states", "text"),
    [
        ([True, True], "kernels compiled"),
        ([False, False], "kernels not compiled: slow"),
        ([True, False], "only 1 of 2 kernels compiled: slow"),
    ],
)
def test_the_version_says_whether_they_are(run, monkeypatch, states, text):
    found = dict(zip("ab", states, strict=True))
    monkeypatch.setattr(kernels, "compiled_kernels", lambda: found)
    assert run("--version").output == f"fpmatch {fpmatch.__version__} ({text})\n"


def test_everything_that_is_installed_is_listed(run):
    result = run("doctor")
    assert result.exit_code == 0
    lines = dict(line.split("  ", 1) for line in result.stdout.splitlines())
    assert lines["cores"].strip() == str(available_cores())
    assert f"numpy {np_version()}" in lines["packages"]
    count = len(kernels.compiled_kernels()) if COMPILED else 0
    assert f"{count} of {len(kernels.compiled_kernels())} compiled" in lines["kernels"]
    document = json.loads(run("doctor", "--json").stdout)
    assert document["version"] == fpmatch.__version__
    assert document["engines"]["serial"] is document["engines"]["processes"] is True
    assert document["problems"] == []
    assert set(document["extras"]) == set(installation.EXTRAS)


@pytest.mark.parametrize(
    ("states", "text"),
    [
        ([True, True], "2 of 2 compiled\n"),
        ([True, False], "1 of 2 compiled, not b: slow; with a C compiler, `make` compiles them\n"),
        ([False, False], "0 of 2 compiled: slow; with a C compiler, `make` compiles them\n"),
    ],
)
def test_kernels_that_are_not_compiled_are_named(monkeypatch, states, text):
    found = dict(zip("ab", states, strict=True))
    monkeypatch.setattr(installation, "compiled_kernels", lambda: found)
    monkeypatch.setattr(installation, "build_command", lambda: "make")
    assert f"\nkernels {text}" in one_space(installation.inspect_installation().as_text())


def one_space(text):
    """Return a table without the widths of its columns."""
    return re.sub(" +", " ", text)


def np_version():
    return importlib.import_module("numpy").__version__


def test_a_missing_package_is_named(run, monkeypatch):
    def version(name):
        if name in {"scipy", "httpx"}:
            raise PackageNotFoundError(name)
        return "9"

    monkeypatch.setattr(installation, "version", version)
    result = run("doctor")
    assert result.exit_code == 1
    assert result.stderr == "fpmatch: error: scipy is not installed\n"
    assert "scipy missing" in result.stdout
    assert "extra client h11 9, httpx missing" in one_space(result.stdout)


def test_opencv_has_several_names(monkeypatch):
    def version(name):
        if name == "opencv-python-headless":
            raise PackageNotFoundError(name)
        return "9"

    monkeypatch.setattr(installation, "version", version)
    assert installation.inspect_installation().packages["opencv-python-headless"] == "9"


@pytest.mark.parametrize(
    ("text", "limit"), [("1073741824\n", 2**30), ("max\n", None), (f"{2**63}\n", None)]
)
def test_the_memory_of_a_container_is_shown_where_it_is_less(tmp_path, monkeypatch, text, limit):
    file = tmp_path / "memory.max"
    file.write_text(text)
    monkeypatch.setattr(installation, "_MEMORY_LIMITS", (tmp_path / "absent", file))
    monkeypatch.setattr(installation, "_memory", lambda: 8 * 2**30)
    found = installation.inspect_installation()
    assert found.memory_limit == limit
    shown = "8.0 GiB, of which this container may use 1.0 GiB" if limit else "8.0 GiB\n"
    assert shown in found.as_text() + "\n"
