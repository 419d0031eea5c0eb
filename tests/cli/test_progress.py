import io
import sys

from fpmatch.cli.progress import ProgressBars


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_bar_tells_stage_share_and_rate(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with ProgressBars({"enrol": "enrolling"}) as bars:
        for done in (0, 5, 10):
            bars.show("enrol", done, 10)
    shown = terminal.getvalue()
    assert "enrolling" in shown
    assert "100%" in shown
    assert " a second" in shown


def test_nothing_where_no_terminal_is(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    with ProgressBars({"enrol": "enrolling"}) as bars:
        bars.show("enrol", 0, 10)
        bars.show("enrol", 10, 10)
    assert stream.getvalue() == ""
