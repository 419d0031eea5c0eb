"""`fpmatch serve`: it opens, answers, ends; without its extra it says so in one line."""

import importlib.util
import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from PIL import Image


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
@pytest.mark.parametrize(
    ("number", "group"),  # a terminal sends to all processes, a service manager perhaps
    [(signal.SIGINT, True), (signal.SIGTERM, True), (signal.SIGTERM, False)],
)
def test_it_opens_answers_and_lets_requests_end(tmp_path, fingers, kernels_line, number, group):
    httpx = pytest.importorskip("httpx", reason="the extra `web` is not installed")
    Image.fromarray(fingers[0]).save(tmp_path / "1_1.png", dpi=(500, 500))
    words = ["serve", "--port", "0", "--gallery", str(tmp_path / "prints.db"), "--workers", "1"]
    command = [sys.executable, "-W", "error", "-m", "fpmatch", *words]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes, start_new_session=True) as server:
        try:
            address = server.stdout.readline().split()[-1]
            assert httpx.get(f"{address}about").json()["gallery"] == "prints.db"
            port = httpx.URL(address).port
            waiting = socket.create_connection(("127.0.0.1", port), 5)
            waiting.sendall(
                b"POST /verify HTTP/1.1\r\nhost: localhost\r\ncontent-length: 9\r\n\r\nx"
            )
            with ThreadPoolExecutor(1) as others:
                files = {"image": (tmp_path / "1_1.png").read_bytes()}
                answer = others.submit(httpx.post, f"{address}stages", files=files, timeout=60)
                time.sleep(0.2)
                (os.killpg if group else os.kill)(server.pid, number)
                assert answer.result().status_code == 200
            assert server.wait(30) == 0
            waiting.close()
            assert server.stderr.read() == f"{kernels_line}Ctrl-C stops it\n"
        finally:
            server.kill()
    assert (tmp_path / "prints.db").exists()
