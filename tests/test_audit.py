"""The audit log: what is appended is read, and what is changed is found."""

import json
import stat
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip("filelock", reason="the extra `web` is not installed")

from fpmatch.audit import START, AuditError, AuditLog, check_audit_log, read_audit_log


@pytest.fixture
def log(tmp_path: Path) -> AuditLog:
    log = AuditLog(tmp_path / "audit.jsonl")
    for number in range(5):
        log.append("ada", "identify", {"candidates": [[number, 40.5]]})
    return log


def test_events_are_read_as_they_were_appended(log: AuditLog) -> None:
    events = list(read_audit_log(log.path))
    assert [event["candidates"][0][0] for event in events] == list(range(5))
    assert events[0]["previous"] == START
    assert {event["client"] for event in events} == {"ada"}


def test_a_log_goes_on_where_it_ended(log: AuditLog) -> None:
    before = check_audit_log(log.path)
    AuditLog(log.path).append("bob", "remove", {})
    after = check_audit_log(log.path)
    assert (before.events, after.events) == (5, 6)
    assert before.last != after.last


@pytest.mark.skipif(sys.platform == "win32", reason="no modes of files on this system")
def test_only_its_owner_may_read_it(log: AuditLog) -> None:
    assert stat.S_IMODE(log.path.stat().st_mode) == 0o600


def test_an_empty_log_is_whole(tmp_path: Path) -> None:
    state = check_audit_log(AuditLog(tmp_path / "audit.jsonl").path)
    assert (state.events, state.last) == (0, START)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda lines: [*lines[:2], *lines[3:]], "changed"),
        (lambda lines: [lines[1], lines[0], *lines[2:]], "changed"),
        (lambda lines: [*lines[:2], lines[2].replace(b"ada", b"bob"), *lines[3:]], "changed"),
        (lambda lines: [*lines[:2], lines[1], *lines[2:]], "changed"),
        (lambda lines: [*lines[:4], lines[4][:-1]], "damaged"),
        (lambda lines: [*lines[:4], b"[]\n"], "damaged"),
        (lambda lines: [b"\xff\n", *lines], "damaged"),
        (lambda lines: [b"[" * 100_000 + b"\n", *lines], "damaged"),
    ],
)
def test_a_change_is_found(log: AuditLog, change: object, code: str) -> None:
    lines = log.path.read_bytes().splitlines(keepends=True)
    log.path.write_bytes(b"".join(change(lines)))  # type: ignore[operator]
    with pytest.raises(AuditError) as caught:
        check_audit_log(log.path)
    assert caught.value.code == code
    assert caught.value.path == str(log.path)


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_no_changed_byte_before_the_last_line_goes_unseen(
    log: AuditLog, data: st.DataObject
) -> None:
    whole = log.path.read_bytes()
    last = whole.rstrip(b"\n").rfind(b"\n") + 1
    place = data.draw(st.integers(0, last - 1))
    byte = data.draw(st.integers(0, 255).filter(lambda value: value != whole[place]))
    log.path.write_bytes(whole[:place] + bytes([byte]) + whole[place + 1 :])
    try:
        with pytest.raises(AuditError):
            check_audit_log(log.path)
    finally:
        log.path.write_bytes(whole)


def test_several_may_append_at_once(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"

    def append(name: str) -> None:
        log = AuditLog(path)
        for _ in range(10):
            log.append(name, "verify", {})

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(append, "abcd"))
    assert check_audit_log(path).events == 40


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(AuditError, match="no such") as caught:
        AuditLog(tmp_path / "missing" / "audit.jsonl")
    assert caught.value.path.endswith("audit.jsonl")
    with pytest.raises(AuditError):
        check_audit_log(tmp_path)


def test_values_that_are_no_json_are_refused_and_nothing_is_written(log: AuditLog) -> None:
    before = log.path.read_bytes()
    with pytest.raises(ValueError, match="JSON"):
        log.append("ada", "verify", {"score": float("nan")})
    assert log.path.read_bytes() == before
    assert json.loads(before.splitlines()[-1])["action"] == "identify"
