"""`fpmatch serve`: it opens, answers, ends; without its extra it says so in one line."""

import importlib.util
import json
import os
import signal
import subprocess
import sys
import urllib.request

import pytest


def test_without_the_extra_one_line_says_so(run, monkeypatch):
    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "hypercorn" else real(name)
    )
    done = run("serve")
    assert done.exit_code == 2
    assert done.stderr == "fpmatch: error: serve needs hypercorn: pip install 'fpmatch[web]'\n"


def test_bad_options_are_one_line(run, tmp_path):
    pytest.importorskip("hypercorn", reason="the extra `web` is not installed")
    (tmp_path / "no.db").write_text("no gallery")
    for words in (["--token", "short"], ["--gallery", tmp_path / "no.db"]):
        done = run("serve", "--port", 0, *words)
        assert done.exit_code == 2, words
        assert done.stderr.count("\n") == 1


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise")
def test_it_opens_answers_and_ends_by_ctrl_c(tmp_path, kernels_line):
    pytest.importorskip("hypercorn", reason="the extra `web` is not installed")
    gallery = tmp_path / "prints.db"
    command = [sys.executable, "-W", "error", "-m", "fpmatch", "serve", "--port", "0"]
    with subprocess.Popen(
        [*command, "--gallery", str(gallery), "--workers", "1"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as server:
        try:
            address = server.stdout.readline().split()[-1]
            with urllib.request.urlopen(f"{address}about") as answer:
                assert json.load(answer)["gallery"] == "prints.db"
            os.killpg(server.pid, signal.SIGINT)  # as a terminal sends it, to its workers too
            assert server.wait(30) == 0
            assert server.stderr.read() == f"{kernels_line}Ctrl-C stops it\n"
        finally:
            server.kill()
    assert gallery.exists()
