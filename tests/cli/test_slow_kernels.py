"""The note of commands that do much work, where kernels are not compiled."""

import json

import pytest

from fpmatch.base import kernels
from fpmatch.base.kernels import slow_kernels_note
from tests.conftest import copied

NOTE = "fpmatch: note: 2 of 3 kernels are not compiled"


@pytest.fixture
def some_interpreted(monkeypatch):
    """Let two of three kernels be not compiled, and commands note it."""
    found = dict(zip("abc", (True, False, False), strict=True))
    monkeypatch.setattr(kernels, "compiled_kernels", lambda: found)
    monkeypatch.setattr(kernels, "slow_kernels_note", slow_kernels_note)


@pytest.mark.usefixtures("some_interpreted")
@pytest.mark.parametrize(
    "words",
    [
        "extract {set}/1_1.png {set}/2_1.png -o {new}",
        "enrol {new}.db {set}",
        "identify {gallery} {set}/1_1.png",
        "evaluate {set} --bootstrap 0 --workers 1",
        "score --references {set} --probes {set} -o {new}.csv --workers 1",
    ],
)
def test_batches_note_it_first(run, prints, gallery, tmp_path, words):
    folder = copied(prints, tmp_path / "set", "1_1.png", "1_2.png", "2_1.png")
    given = words.format(set=folder, gallery=gallery, new=tmp_path / "new").split()
    result = run(*given, "--json")
    assert result.exit_code == 0, result.stderr
    assert result.stderr.startswith(NOTE)
    assert result.stderr.count("kernels") == 1
    assert "kernels" not in json.loads(result.stdout)


@pytest.mark.usefixtures("some_interpreted")
def test_two_prints_or_one_image_take_no_note(run, prints, tmp_path):
    image = prints / "1_1.png"
    assert "kernels" not in run("verify", image, prints / "1_2.png").stderr
    assert "kernels" not in run("extract", image, "-o", tmp_path).stderr


def test_there_is_no_note_where_all_are_compiled(monkeypatch):
    monkeypatch.setattr(kernels, "compiled_kernels", lambda: {"a": True, "b": True})
    assert slow_kernels_note() is None
