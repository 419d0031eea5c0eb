"""The audit log: what is appended is read, and what is changed is found."""

import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fpmatch.gallery.store.audit_chain import (
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
