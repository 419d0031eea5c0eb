"""`fpmatch.gallery.engine.workers`: results in order, and attempts that stop nothing."""

import os
from itertools import count, islice

import pytest

from fpmatch.base.threads import available_cores
from fpmatch.errors import ImageError
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.engine.workers import attempt_all, attempt_each, results_of_each, run_chunks


def add(shared, chunk):
    return shared + chunk


def test_results_come_in_order_and_are_reported_in_order():
    finished = []
    assert run_chunks(add, 10, [3, 1, 2], workers=1, finished=finished.append) == [13, 11, 12]
    assert finished == [3, 1, 2]


def test_without_work_nothing_starts_and_there_is_a_core():
    assert run_chunks(add, 10, []) == []
    assert 1 <= available_cores() <= (os.cpu_count() or 1)


def halve(number):
    if number % 2:
        raise ImageError(f"{number} is odd")
    if number > 9:
        raise ValueError(number)
    return number // 2


@pytest.mark.parametrize("workers", [1, 2])
def test_an_item_that_is_refused_stops_nothing(workers):
    calls = []
    found = attempt_all(
        halve,
        [4, 1, 0, 8, 3],
        stage="halve",
        workers=workers,
        progress=lambda *call: calls.append(call),
    )
    assert [attempt.result for attempt in found] == [2, None, 0, 4, None]
    assert [attempt.reason for attempt in found] == ["", "1 is odd", "", "", "3 is odd"]
    assert all(attempt.cpu_ms >= 0 for attempt in found)
    assert calls == [("halve", done, 5) for done in range(6)]


def test_items_are_drawn_as_they_are_needed_and_other_errors_come_through():
    drawn = count()
    attempts = attempt_each(serial(), halve, drawn)
    assert [item for item, _ in islice(attempts, 4)] == [0, 1, 2, 3]
    assert next(drawn) == 4
    with pytest.raises(ValueError, match="10"):
        list(attempts)
    assert list(results_of_each(serial(), halve, [4, 1, 0])) == [2, None, 0]
