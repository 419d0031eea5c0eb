"""`fpmatch doctor` and `--version`: what is installed, and whether the kernels are compiled."""

import importlib
import json
import re
from importlib.metadata import PackageNotFoundError

import numpy as np
import pytest

import fpmatch
from fpmatch.base import kernels
from fpmatch.base.threads import available_cores
from fpmatch.cli import doctor as installation
from fpmatch.matching.pipeline._kernels._local_kernel import COMPILED


def test_kernels_are_compiled_where_they_are_loaded_so():
    states = kernels.compiled_kernels()
    assert len(states) > 20
    assert set(states.values()) == {COMPILED}
    for name, compiled in states.items():
        assert str(importlib.import_module(name).__file__).endswith(".py") is not compiled


@pytest.mark.parametrize(
    ("states", "version", "doctor"),
    [
        ([True, True], "kernels compiled", "2 of 2 compiled\n"),
        ([True, False], "only 1 of 2 kernels compiled: slow", "1 of 2 compiled, not b: slow; "),
        ([False, False], "kernels not compiled: slow", "0 of 2 compiled: slow; "),
    ],
)
def test_version_and_doctor_say_whether_they_are(run, monkeypatch, states, version, doctor):
    for module in (kernels, installation):
        monkeypatch.setattr(
            module, "compiled_kernels", lambda: dict(zip("ab", states, strict=True))
        )
    monkeypatch.setattr(installation, "build_command", lambda: "make")
    assert run("--version").output == f"fpmatch {fpmatch.__version__} ({version})\n"
    text = one_space(installation.inspect_installation().as_text())
    assert f"\nkernels {doctor}" in text
    assert ("`make`" in text) == (False in states)


def test_everything_that_is_installed_is_listed(run):
    result = run("doctor")
    assert result.exit_code == 0
    lines = dict(line.split("  ", 1) for line in result.stdout.splitlines())
    assert lines["cores"].strip() == str(available_cores())
    assert f"numpy {np.__version__}" in lines["packages"]
    document = json.loads(run("doctor", "--json").stdout)
    assert document["version"] == fpmatch.__version__
    assert document["engines"]["serial"] is document["engines"]["processes"] is True
    assert document["problems"] == []
    assert set(document["extras"]) == set(installation.EXTRAS)


def one_space(text):
    """Return a table without the widths of its columns."""
    return re.sub(" +", " ", text)


@pytest.fixture
def without(monkeypatch):
    """Return a function that lets packages be missing, and all others have version 9."""

    def miss(*missing):
        def version(name):
            if name in missing:
                raise PackageNotFoundError(name)
            return "9"

        monkeypatch.setattr(installation, "version", version)

    return miss


def test_a_missing_package_is_named(run, without):
    without("scipy", "pyarrow")
    result = run("doctor")
    assert result.exit_code == 1
    assert result.stderr.startswith("fpmatch: error: scipy ")
    assert "scipy missing" in result.stdout
    assert "extra parquet pyarrow missing" in one_space(result.stdout)


def test_opencv_has_several_names(without):
    without("opencv-python-headless")
    assert installation.inspect_installation().packages["opencv-python-headless"] == "9"


@pytest.mark.parametrize(
    ("text", "limit"), [("1073741824\n", 2**30), ("max\n", None), (f"{2**63}\n", None)]
)
def test_the_memory_of_a_container_is_shown_where_it_is_less(tmp_path, monkeypatch, text, limit):
    file = tmp_path / "memory.max"
    file.write_text(text)
    monkeypatch.setattr(installation, "_MEMORY_LIMITS", (tmp_path / "absent", file))
    monkeypatch.setattr(installation, "_memory", lambda: 8 * 2**30)
    installed = installation.inspect_installation()
    assert installed.memory_limit == limit
    assert ("1.0 GiB" in installed.as_text()) == (limit is not None)


def test_doctor_lists_the_parameters_of_matchers(run):
    listed = json.loads(run("doctor", "--matchers", "--json").stdout)
    steps = listed["unit-circle"]
    known = {one["name"]: one for many in steps.values() for one in many}
    assert known["rounds"]["value"] == 3
    assert (known["reach_px"]["unit"], known["place_tolerance"]["unit"]) == (
        "px at 500 dpi",
        "radians",
    )
    text = run("doctor", "--matchers").stdout
    assert all(f"\n    {name} " in text for name in known)
    assert "reference: the parameters of unit-circle" in text
    assert {one["name"] for many in listed["paper"].values() for one in many} >= {
        "rho",
        "precision",
    }
