"""`fpmatch.engine.workers`: results in order, whoever computed them."""

from __future__ import annotations

import os

from fpmatch.engine.local import available_cores
from fpmatch.engine.workers import run_chunks


def add(shared, chunk):
    return shared + chunk


def test_results_come_in_order_and_are_reported_in_order():
    finished = []
    assert run_chunks(add, 10, [3, 1, 2], workers=1, finished=finished.append) == [13, 11, 12]
    assert finished == [3, 1, 2]


def test_nothing_to_do():
    assert run_chunks(add, 10, []) == []


def test_there_is_a_core():
    assert 1 <= available_cores() <= (os.cpu_count() or 1)
