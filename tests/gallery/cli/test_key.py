"""`fpmatch key`, and the option --key."""

import json
from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def no_key(monkeypatch, tmp_path):
    monkeypatch.delenv("FPMATCH_KEY", raising=False)
    monkeypatch.chdir(tmp_path)


def test_keys_are_made_added_and_listed(run):
    made = run("key", "keys.txt", "--new")
    assert made.exit_code == 0
    assert "keep a copy" in made.stderr
    assert Path("keys.txt").stat().st_mode & 0o777 == 0o600
    added = json.loads(run("key", "file:keys.txt", "--add", "--json").stdout)
    first = made.stdout.split()[-1]
    assert added == {
        "source": "file:keys.txt",
        "current": added["keys"][0],
        "keys": [added["current"], first],
    }
    assert run("key", "keys.txt").stdout == f"{added['current']}  current\n{first}\n"


def test_no_secret_is_printed(run):
    out = [run("key", "k", "--new"), run("key", "k"), run("key", "k", "--json")]
    secret = Path("k").read_text().split()[-1]
    for words in ("points k k", "rates k", "calibrate k -o c.json"):
        out.append(run(*words.split()))
        assert out[-1].exit_code == 2
    assert not any(secret[:30] in one.stdout + one.stderr for one in out)


def test_what_cannot_be_done_is_one_line(run):
    run("key", "k", "--new")
    for words in (["k", "--new"], ["/dev/null/k", "--new"], ["none"]):
        result = run("key", *words)
        assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
        assert result.stderr.startswith("fpmatch: error: ")
    assert run("key", "x", "--new", "--add").exit_code == 2
    assert not Path("x").exists()


def test_what_is_no_source_is_refused_without_repeating_it(run):
    for text in ("k", "QUJD", "file:", "x:y"):
        result = run("gallery", "list", "g.db", "--key", text)
        assert result.exit_code == 2
        assert "expected file:PATH" in result.stderr
        assert "QUJD" not in result.stderr
