"""``fpmatch revocable``: protect and compare, and its matcher in other commands."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from fpmatch.cli.group import fpmatch
from fpmatch.gallery.encryption.key_text import make_keys
from fpmatch_revocable.matcher import CALIBRATION

SAMPLES = Path(__file__).parents[2] / "sample_data"
pytestmark = pytest.mark.skipif(not SAMPLES.is_dir(), reason="the sample prints are not here")


@pytest.fixture
def run(tmp_path, monkeypatch, installed):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("FPMATCH_KEY", raising=False)
    make_keys("file:a.key")
    make_keys("file:b.key")
    return lambda *words: CliRunner().invoke(fpmatch, [str(word) for word in words])


def protected(run, sample, target, key="a.key"):
    words = "revocable", "protect", SAMPLES / sample, "-o", target, "--key", f"file:{key}"
    done = run(*words)
    assert done.exit_code == 0, done.output
    return target


def test_two_prints_of_a_finger_match_and_two_fingers_do_not(run):
    one, again, other = (
        protected(run, f"{name}.tif", f"{name}.rev") for name in ("101_1", "101_3", "102_1")
    )
    done = run("revocable", "compare", one, again)
    assert (done.exit_code, done.output.startswith("MATCH\n")) == (0, True)
    done = run("revocable", "compare", one, other, "--json")
    document = json.loads(done.output)
    assert (done.exit_code, document["match"]) == (1, False)
    assert document["score"] < document["threshold"] == 30
    assert set(document) == {"match", "score", "fmr", "threshold", "similarity", "key"}


def test_templates_of_two_keys_are_refused(run):
    a = protected(run, "101_1.tif", "a.rev")
    b = protected(run, "101_1.tif", "b.rev", key="b.key")
    done = run("revocable", "compare", a, b)
    assert (done.exit_code, done.output.count("\n")) == (2, 1)
    assert "different keys" in done.output


def test_bad_input_is_one_line_and_writes_nothing(run, tmp_path):
    a = protected(run, "101_1.tif", "a.rev")
    for words, why in [
        (("compare", a, SAMPLES / "101_1.tif"), "101_1.tif: "),
        (("compare", a, "none.rev"), "none.rev: "),
        (("protect", SAMPLES / "101_1.tif", "-o", "x.rev"), "no key"),
        (("protect", a, "-o", "x.rev", "--key", "file:a.key"), "a.rev: "),
        (("compare", a, a, "--fmr", "2"), "2"),
    ]:
        done = run("revocable", *words)
        assert (done.exit_code, why in done.output.splitlines()[-1]) == (2, True), words
    assert not (tmp_path / "x.rev").exists()


def test_the_matcher_takes_its_key_from_the_environment(run, monkeypatch):
    words = "--matcher", "revocable", "--calibration", CALIBRATION, "--json", "--fmr", 0.01
    words = "verify", SAMPLES / "101_1.tif", SAMPLES / "101_3.tif", *words
    done = run(*words)
    assert (done.exit_code, "no key" in done.output) == (2, True)
    for key in ("file:a.key", "file:b.key"):
        monkeypatch.setenv("FPMATCH_KEY", key)
        assert json.loads(run(*words).output)["match"] is True


def test_its_command_is_listed_with_its_package(run, installed):
    assert f"revocable  {installed['name']} 1.0" in run("--help").output
    assert "commands added" in run("doctor").output
    for words in ([], ["protect"], ["compare"]):
        done = run("revocable", *words, "--help")
        assert done.exit_code == 0
        assert f"  fpmatch {' '.join(['revocable', *words])} " in done.output.split("Example")[1]


def test_without_its_package_the_command_states_it():
    done = CliRunner().invoke(fpmatch, ["revocable", "protect", "a.tif"])
    assert done.exit_code == 2
    assert "fpmatch-revocable, in examples/revocable" in done.output.splitlines()[-1]
