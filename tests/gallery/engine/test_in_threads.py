"""Threads of this process do the work of one call, and leave none of it to run on."""

import threading
from collections import deque

import pytest

from fpmatch.gallery.engine import in_threads
from fpmatch.gallery.engine.in_threads import Threads

WAIT_S = 60.0


def this_thread(_shared, _chunk):
    return threading.get_ident()


@pytest.fixture
def emptied(monkeypatch):
    """Return an event that is set when the chunks that nobody has begun are thrown away."""
    event = threading.Event()

    class Pending(deque):
        def clear(self):
            super().clear()
            event.set()

    monkeypatch.setattr(in_threads, "deque", Pending)
    return event


def test_results_are_in_the_order_of_the_chunks():
    with Threads(3) as threads:
        assert list(threads.map(pow, 2, range(100))) == [2**k for k in range(100)]
        assert list(threads.map(pow, 2, iter([5]))) == [32]
        assert list(threads.map(pow, 2, [])) == []


def test_so_many_threads_work_at_once_and_the_callers_is_one():
    meeting = threading.Barrier(3)

    def meet(_shared, _chunk):
        meeting.wait(WAIT_S)
        return threading.get_ident()

    with Threads(3) as threads:
        assert len({threading.get_ident(), *threads.map(meet, None, range(3))}) == 3


def test_the_threads_end_with_the_block():
    before = threading.active_count()
    with Threads(2) as threads:
        list(threads.map(this_thread, None, range(10)))
    assert threading.active_count() == before


@pytest.mark.parametrize("by_caller", [True, False])
@pytest.mark.parametrize("kind", [IndexError, KeyboardInterrupt])
def test_after_an_error_nothing_is_begun(by_caller, kind, emptied):
    """Both threads have begun a chunk; one fails, and the other ends its own after that."""
    caller, both, begun = threading.get_ident(), threading.Barrier(2), []

    def work(_, chunk):
        begun.append(chunk)
        both.wait(WAIT_S)
        if (threading.get_ident() == caller) == by_caller:
            raise kind(chunk)
        emptied.wait(WAIT_S)

    with pytest.raises(kind), Threads(2) as threads:
        list(threads.map(work, None, range(50)))
    assert sorted(begun) == [0, 1]


def test_an_interrupt_while_threads_start_leaves_them_no_work(monkeypatch, emptied):
    begun, start = [], Threads._start

    def interrupted(self, work):
        start(self, work)
        raise KeyboardInterrupt

    def work(_, chunk):
        begun.append(chunk)
        emptied.wait(WAIT_S)

    monkeypatch.setattr(Threads, "_start", interrupted)
    with pytest.raises(KeyboardInterrupt), Threads(2) as threads:
        list(threads.map(work, None, range(50)))
    assert len(begun) <= 1
