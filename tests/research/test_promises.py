import json
import re
from pathlib import Path
from random import Random

import pytest

from research.commands import ROOT
from research.markdown import marked_block
from research.promises.attack import attempt
from research.promises.command import MODULES, promises
from research.promises.mutants import mutants, tiff
from research.promises.program import Place, Run, traces
from research.tables.serving import format_promises

PAGE = (ROOT / "docs" / "security.md").read_text("utf-8")
ROWS = re.findall(r"^\| (.+?) \| `tests/", PAGE, re.MULTILINE)


def test_every_promise_of_the_page_has_one_attack_or_a_reason():
    assert MODULES
    assert len(ROWS) > 50
    for row in ROWS:
        assert sum(row.startswith(promise) for promise in promises()) == 1, row
    for promise in promises():
        assert sum(row.startswith(promise) for row in ROWS) == 1, promise


def test_the_record_has_every_attack_and_the_page_shows_it():
    record = json.loads((ROOT / "docs" / "data" / "promises.json").read_text("utf-8"))
    assert [one["promise"] for one in record] == promises()
    assert all(one["tries"] > 0 for one in record if one["name"])
    assert marked_block(PAGE, "promises") == format_promises(record).strip()


@pytest.mark.parametrize(
    ("results", "broken", "example"),
    [
        ((True, True), 0, ""),
        ((True, "a\nb", "c"), 2, "a b"),
        ((OSError("full"),), 1, "OSError: full"),
    ],
)
def test_an_attempt_counts_what_broke_the_promise(tmp_path, results, broken, example):
    def attack(place):
        """Try."""
        for result in results:
            if isinstance(result, OSError):
                raise result
            yield result

    outcome = attempt("promise", attack, Place(tmp_path, Random(1), tmp_path))
    assert (outcome.attack, outcome.name, outcome.broken) == ("Try", "attack", broken)
    assert outcome.example.endswith(example)


@pytest.mark.parametrize(
    ("status", "err", "refused"),
    [
        (2, "fpmatch: error: a\n", True),
        (2, "fpmatch: note: b\nfpmatch: error: a\n", True),
        (2, "Usage: fpmatch\nTry 'fpmatch -h' for help.\n\nError: a\n", True),
        (2, "fpmatch: error: a\nfpmatch: error: b\n", False),
        (1, "fpmatch: error: a\n", False),
        (2, "Traceback\n", False),
        (2, "", False),
    ],
)
def test_a_refusal_is_one_line_and_status_2(status, err, refused):
    assert (Run(("verify",), status, "", err).refused is True) == refused


def test_traces_are_runs_of_a_secret_in_any_file(tmp_path):
    secret = bytes(range(100))
    assert traces([secret], tmp_path, 32) == 0
    (tmp_path / "inner").mkdir()
    Path(tmp_path, "inner", "file").write_bytes(b"x" + secret[10:43] + b"y")
    assert traces([secret], tmp_path, 32) == 2


def test_mutants_depend_on_the_seed_and_differ():
    good = b"P5 10 10 255\n" + bytes(100)
    made = list(mutants(good, Random(1), 50))
    assert made == list(mutants(good, Random(1), 50))
    assert sum(one != good for one in made) > 40


def test_the_tiff_of_many_strips_is_one(tmp_path):
    from PIL import Image

    path = tmp_path / "a.tif"
    path.write_bytes(tiff(4, 3, [4] * 3))
    with Image.open(path) as image:
        assert image.size == (4, 3)


def test_unknown_attacks_are_refused():
    from click.testing import CliRunner

    from research.promises.command import command

    result = CliRunner().invoke(command, ["--only", "nonsense"])
    assert result.exit_code == 2
    assert "damaged_pictures" in result.output
