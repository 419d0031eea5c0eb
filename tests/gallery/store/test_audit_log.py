"""The audit log: what is appended is read, and what is changed is found."""

import json
import stat
import sys
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_prints import refused

from fpmatch.gallery.store import audit_chain
from fpmatch.gallery.store.audit_chain import (
    INCOMPLETE,
    OPERATOR,
    START,
    AuditError,
    act_as,
    current_client,
)
from fpmatch.gallery.store.audit_log import AuditLog, check_audit_log


@pytest.fixture
def log(tmp_path):
    log = AuditLog(tmp_path / "audit.jsonl")
    for number in range(5):
        log.append("ada", "identify", {"candidates": [[number, 40.5]]})
    return log


def events_of(log, last=0):
    """Return the last events of a log, all where none are counted."""
    return [json.loads(line) for line in log.path.read_bytes().splitlines()[-last:]]


def test_events_are_stored_as_they_were_appended(log):
    events = events_of(log)
    assert check_audit_log(log.path).events == len(events)
    assert [event["candidates"][0][0] for event in events] == list(range(5))
    assert events[0]["previous"] == START
    assert {event["client"] for event in events} == {"ada"}


def test_a_log_goes_on_where_it_ended(log):
    before = check_audit_log(log.path)
    AuditLog(log.path).append("bob", "remove", {})
    after = check_audit_log(log.path)
    assert (before.events, after.events) == (5, 6)
    assert before.last != after.last


def test_events_stay_in_order_when_the_clock_is_set_back(log, monkeypatch):
    class Earlier(datetime):
        @classmethod
        def now(cls, tz=None):
            return cls(2001, 1, 1, tzinfo=tz)

    monkeypatch.setattr(audit_chain, "datetime", Earlier)
    log.append("ada", "remove", {"entries": [3]})
    monkeypatch.undo()
    log.append("ada", "enrol", {})
    assert check_audit_log(log.path).events == 7
    *_, before, set_back, after = events_of(log)
    assert [event["action"] for event in (set_back, after)] == ["remove", "enrol"]
    assert set_back["time"] < before["time"] <= after["time"]


@pytest.mark.skipif(sys.platform == "win32", reason="no modes of files on this system")
def test_only_its_owner_may_read_it(log):
    assert stat.S_IMODE(log.path.stat().st_mode) == 0o600


def test_an_empty_log_is_whole(tmp_path):
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
def test_a_change_is_found(log, change, code):
    lines = log.path.read_bytes().splitlines(keepends=True)
    log.path.write_bytes(b"".join(change(lines)))
    error = refused(check_audit_log, log.path, code=code, kind=AuditError)
    assert error.path == str(log.path)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_no_changed_byte_before_the_last_line_goes_unseen(log, data):
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


def test_several_may_append_at_once(tmp_path):
    path = tmp_path / "audit.jsonl"

    def append(name):
        log = AuditLog(path)
        for _ in range(10):
            log.append(name, "verify", {})

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(append, "abcd"))
    assert check_audit_log(path).events == 40


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(AuditError, match="no such") as caught:
        AuditLog(tmp_path / "missing" / "audit.jsonl")
    assert caught.value.path.endswith("audit.jsonl")
    with pytest.raises(AuditError):
        check_audit_log(tmp_path)


def test_values_that_are_no_json_are_refused_and_nothing_is_written(log):
    before = log.path.read_bytes()
    with pytest.raises(ValueError, match="JSON"):
        log.append("ada", "verify", {"score": float("nan")})
    assert log.path.read_bytes() == before
    assert json.loads(before.splitlines()[-1])["action"] == "identify"


def cut(log, left):
    """Leave so many bytes of the last line, as a program that was killed does."""
    whole = log.path.read_bytes()
    last = whole.rstrip(b"\n").rfind(b"\n") + 1
    log.path.write_bytes(whole[: last + left])
    return log.path.read_bytes()


@pytest.mark.parametrize("left", [1, 7, 40])
def test_after_half_a_line_the_next_event_states_it(log, left):
    torn = cut(log, left)
    with pytest.raises(AuditError, match="line 5 is damaged"):
        check_audit_log(log.path)
    AuditLog(log.path).append("bob", "remove", {})
    assert log.path.read_bytes().startswith(torn + b"\n")
    state = check_audit_log(log.path)
    assert (state.events, state.incomplete) == (7, [5])
    note, last = events_of(log, 2)
    assert (note["action"], note["bytes"], last["client"]) == (INCOMPLETE, left, "bob")


def test_a_line_that_lacks_its_end_only_is_kept(log):
    log.path.write_bytes(log.path.read_bytes()[:-1])
    log.append("bob", "remove", {})
    assert check_audit_log(log.path).events == 6
    assert [event["client"] for event in events_of(log)] == [*["ada"] * 5, "bob"]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.integers(1, 400), min_size=1, max_size=4), st.booleans())
def test_a_log_goes_on_whatever_was_left_of_it(tmp_path, kept, zeros):
    log = AuditLog(tmp_path / "audit.jsonl")
    log.path.write_bytes(b"")
    log.append("ada", "verify", {})
    for left in kept:
        start = log.path.stat().st_size
        log.append("ada", "verify", {"entries": [1]})
        whole = log.path.read_bytes()
        tail = bytes(left) if zeros else whole[start : start + left].rstrip(b"\n")
        log.path.write_bytes(whole[:start] + tail)
    log.append("ada", "verify", {})
    check_audit_log(log.path)


def test_lines_of_an_incomplete_one_cannot_be_changed(log):
    cut(log, 20)
    log.append("bob", "remove", {})
    lines = log.path.read_bytes().splitlines(keepends=True)
    for k, changed in ((4, b"{\n"), (3, b""), (4, b""), (4, lines[4] + lines[4])):
        log.path.write_bytes(b"".join([*lines[:k], changed, *lines[k + 1 :]]))
        with pytest.raises(AuditError):
            check_audit_log(log.path)


def test_an_earlier_state_is_a_part_of_this_one(log):
    before = check_audit_log(log.path)
    expect = (before.events, before.last)
    log.append("bob", "remove", {})
    assert check_audit_log(log.path, expect=expect).events == 6
    assert check_audit_log(log.path, expect=(0, START)).events == 6
    lines = log.path.read_bytes().splitlines(keepends=True)
    log.path.write_bytes(b"".join(lines[:4]))
    refused(check_audit_log, log.path, expect=expect, code="shortened", kind=AuditError)
    log.append("bob", "other", {})
    refused(check_audit_log, log.path, expect=expect, code="changed", kind=AuditError)


def test_a_long_line_is_followed(tmp_path):
    log = AuditLog(tmp_path / "audit.jsonl")
    for _ in range(3):
        log.append("ada", "remove", {"entries": list(range(200_000))})
    assert log.path.stat().st_size > 3_000_000
    assert check_audit_log(log.path).events == 3


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device on this system")
def test_a_full_disk_is_an_error_of_one_line(tmp_path):
    path = tmp_path / "audit.jsonl"
    path.symlink_to("/dev/full")
    log = AuditLog(path)
    with pytest.raises(AuditError, match="cannot be written: no space left"):
        log.append("ada", "verify", {})


def test_a_failed_append_leaves_nothing(log, monkeypatch):
    before = log.path.read_bytes()

    def fail(_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("os.fsync", fail)
        with pytest.raises(AuditError, match="no space left"):
            log.append("bob", "remove", {})
    assert log.path.read_bytes() == before
    log.append("bob", "remove", {})
    assert check_audit_log(log.path).events == 6


def test_who_requests_it(monkeypatch):
    monkeypatch.delenv(OPERATOR, raising=False)
    user = current_client()
    assert "@" in user
    monkeypatch.setenv("LOGNAME", "nobody-else")
    assert current_client() == user
    monkeypatch.setenv(OPERATOR, "ada")
    assert current_client() == f"ada ({user})"
    assert act_as("bob", current_client) == "bob"


def test_any_text_is_stored_and_read(log):
    log.append("ada\udcff", "enrol", {"subject": "Zoë \ud800 \x1b[2J\u2028"})
    assert check_audit_log(log.path).events == 6
    (event,) = events_of(log, 1)
    assert event["client"] == r"ada\xff"
    assert event["subject"].startswith("Zoë \\ud800 \x1b")
    assert log.path.read_bytes().isascii()
