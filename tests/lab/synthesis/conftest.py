"""A finger that several tests press."""

import pytest

from fpmatch.lab.synthesis.master import MasterParameters, make_master


@pytest.fixture(scope="session")
def master():
    return make_master(3, 1, MasterParameters(shape=(288, 240)))
