"""Threads of this process do the work of one call, and leave none of it to run on."""

import threading

import pytest

from fpmatch.gallery.engine.in_threads import Threads


def test_results_are_in_the_order_of_the_chunks_and_threads_end_with_the_block():
    before = threading.active_count()
    with Threads(3) as threads:
        assert list(threads.map(pow, 2, range(100))) == [2**k for k in range(100)]
        assert list(threads.map(pow, 2, iter([5]))) == [32]
        assert list(threads.map(pow, 2, [])) == []
    assert threading.active_count() == before
    with pytest.raises(ValueError, match="greater than 0"):
        Threads(0)


def test_so_many_threads_work_at_once():
    meeting = threading.Barrier(3)

    def meet(_shared, _chunk):
        meeting.wait(60.0)
        return threading.get_ident()

    with Threads(3) as threads:
        assert len({*threads.map(meet, None, range(3))}) == 3


@pytest.mark.parametrize("kind", [IndexError, KeyboardInterrupt])
def test_after_an_error_nothing_is_begun(kind):
    """Two threads have begun a chunk; one fails, and the other ends its own after that."""
    failed, both, begun = threading.Event(), threading.Barrier(2), []

    def work(_, chunk):
        begun.append(chunk)
        if chunk < 2:
            both.wait(60.0)
        if chunk == 0:
            raise kind(chunk)
        failed.wait(60.0)

    def run():
        with Threads(2) as threads:
            try:
                list(threads.map(work, None, range(50)))
            finally:
                failed.set()

    with pytest.raises(kind):
        run()
    assert len(begun) <= 3
