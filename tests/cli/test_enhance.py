"""The option `--enhance`: the way that is asked for finds the ridges, in every command."""

from __future__ import annotations

import pickle

import pytest

from fpmatch import load_template, reading
from fpmatch.cli.options import ENHANCEMENTS as WAYS
from fpmatch.evaluation import extraction
from fpmatch.image import extract as extraction_of_one
from fpmatch.image.extract import DEFAULT_ENHANCEMENT, extract


def test_the_first_is_the_default_of_the_extraction():
    assert WAYS[0] == DEFAULT_ENHANCEMENT


@pytest.fixture
def asked(monkeypatch):
    """Return the list of the ways in which prints are extracted from now on."""
    ways: list[str] = []

    def noted(*arguments, enhance="", **others):
        ways.append(enhance)
        return extract(*arguments, enhance=enhance, **others)

    monkeypatch.setattr(extraction_of_one, "extract", noted)
    monkeypatch.setattr(reading, "extract", noted)
    return ways


@pytest.mark.parametrize("words", [[], ["--enhance", "filters"], ["--enhance", "learned"]])
@pytest.mark.parametrize("command", ["verify", "overlay", "extract", "stages"])
def test_every_command_finds_ridges_as_it_is_told(run, prints, tmp_path, asked, command, words):
    print_ = prints / "1_1.png"
    files = [print_, print_] if command in {"verify", "overlay"} else [print_]
    where = {"overlay": "a.png", "extract": "out", "stages": "out"}.get(command)
    output = ["-o", tmp_path / where] if where else []
    result = run(command, *files, *output, *words)
    assert (result.exit_code, result.stderr) == (0, "")
    assert asked == [words[1] if words else "learned"] * len(files)


def test_the_stages_are_those_of_the_way(run, prints, tmp_path):
    for way in WAYS:
        out = tmp_path / way
        assert run("stages", prints / "1_1.png", "-o", out, "--enhance", way).exit_code == 0
        drawn = {file.stem.partition("_")[2] for file in out.iterdir()}
        assert {"enhanced", "mask", "orientation", "coherence"} < drawn
        assert ("period" in drawn) == (way == "filters")


def test_templates_differ_and_a_template_is_taken_as_it_is(run, prints, tmp_path):
    for way in WAYS:
        words = ("extract", prints / "1_1.png", "-o", tmp_path / way, "--enhance", way)
        assert run(*words).exit_code == 0
    one, other = (load_template(tmp_path / way / "1_1.json") for way in WAYS)
    assert one != other
    again = tmp_path / "again"
    run("extract", tmp_path / "learned" / "1_1.json", "-o", again, "--enhance", "filters")
    assert load_template(again / "1_1.json") == one


@pytest.mark.parametrize("way", WAYS)
def test_evaluate_extracts_in_the_way_that_it_is_told(run, prints, tmp_path, asked, way):
    folder = tmp_path / "set"
    folder.mkdir()
    for name in ("1_1", "1_2", "2_1"):
        (folder / f"{name}.png").write_bytes((prints / f"{name}.png").read_bytes())
    words = ("--enhance", way, "--workers", 1, "--bootstrap", 0)
    result = run("evaluate", folder, *words)
    assert result.exit_code == 0
    assert asked == [way] * 3


def test_an_extractor_can_be_named_for_other_processes():
    read = reading.PrintReader(quiet=True).image
    extractor = pickle.loads(pickle.dumps(extraction.extractor_of("filters", read)))
    assert extractor.func is extraction.extract_image
    assert extractor.keywords["enhance"] == "filters"
    assert extractor.keywords["reader"].__self__ == read.__self__
