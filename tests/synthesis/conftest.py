"""A finger that several tests press."""

from __future__ import annotations

import pytest

from fpmatch.synthesis.master import Master, MasterParameters, make_master


@pytest.fixture(scope="session")
def master() -> Master:
    return make_master(3, 1, MasterParameters(shape=(288, 240)))
