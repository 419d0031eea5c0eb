"""A file of audit lines: what is changed is found."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fpmatch.gallery.store.audit_chain import (
    OPERATOR,
    START,
    AuditError,
    AuditState,
    act_as,
    check_audit_log,
    current_client,
    event_line,
    hash_of,
)


@pytest.fixture
def log(tmp_path):
    """Return a file of the lines of five events."""
    lines = []
    for number in range(5):
        previous = hash_of(lines[-1]) if lines else START
        lines.append(event_line(previous, "ada", "identify", {"candidates": [[number, 40.5]]}))
    (tmp_path / "audit.jsonl").write_bytes(b"".join(lines))
    return tmp_path / "audit.jsonl"


def test_whole_lines_are_counted(log):
    assert check_audit_log(log) == AuditState(5, hash_of(log.read_bytes().splitlines(True)[-1]))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_no_changed_byte_before_the_last_line_goes_unseen(log, data):
    whole = log.read_bytes()
    last = whole.rstrip(b"\n").rfind(b"\n") + 1
    place = data.draw(st.integers(0, last - 1))
    byte = data.draw(st.integers(0, 255).filter(lambda value: value != whole[place]))
    log.write_bytes(whole[:place] + bytes([byte]) + whole[place + 1 :])
    try:
        with pytest.raises(AuditError):
            check_audit_log(log)
    finally:
        log.write_bytes(whole)


def test_who_requests_it(monkeypatch):
    monkeypatch.delenv(OPERATOR, raising=False)
    user = current_client()
    assert "@" in user
    monkeypatch.setenv("LOGNAME", "nobody-else")
    assert current_client() == user
    monkeypatch.setenv(OPERATOR, "ada")
    assert current_client() == f"ada ({user})"
    assert act_as("bob", current_client) == "bob"
