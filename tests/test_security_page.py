"""The page on security: every promise names tests, and they exist."""

import ast
import re
import socket
from functools import cache
from pathlib import Path

import pytest

import fpmatch

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs/security.md").read_text("utf-8")
FEWEST = 30  # promises on the page


def promises():
    """Return each promise with the cell that names its tests."""
    tables = re.findall(r"^\| promise \| tests \|\n\|---\|---\|\n((?:\|.*\|\n)+)", PAGE, re.M)
    rows = [line.strip("|\n").split(" | ") for table in tables for line in table.splitlines()]
    return [(promise.strip(), tests.strip()) for promise, tests in rows]


@cache
def names_in(path):
    tree = ast.parse((ROOT / path).read_text("utf-8"))
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    return {node.name for node in ast.walk(tree) if isinstance(node, kinds)}


def test_all_tables_of_promises_are_read():
    section = PAGE.split("## What is promised")[1].split("## What is not protected")[0]
    rows = [line for line in section.splitlines() if line.startswith("|")]
    headers = [line for line in rows if re.match(r"\| promise \||\|---", line)]
    assert len(promises()) == len(rows) - len(headers) >= FEWEST


@pytest.mark.parametrize(("promise", "tests"), promises(), ids=lambda text: text[:40])
def test_each_promise_names_tests_that_exist(promise, tests):
    named = re.findall(r"`(tests/[\w/]+\.py)::(test_\w+)`", tests)
    assert named, promise
    assert re.sub(r"`tests/[\w/]+\.py::test_\w+`", "", tests).strip(", ") == ""
    for path, name in named:
        assert name in names_in(path), f"{path}::{name}"


def test_the_policy_leads_to_the_page():
    assert "(docs/security.md)" in (ROOT / "SECURITY.md").read_text("utf-8")


def test_a_comparison_opens_no_connection(monkeypatch):
    def refuse(*_):
        raise AssertionError("a connection was opened")

    for name in ("connect", "connect_ex", "bind", "sendto"):
        monkeypatch.setattr(socket.socket, name, refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    samples = ROOT / "sample_data"
    if not samples.is_dir():
        pytest.skip("the sample prints are not beside the package")
    assert fpmatch.verify(samples / "101_1.tif", samples / "101_3.tif").match
