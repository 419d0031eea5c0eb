"""The kernels of packed prints, and of matching, as ordinary Python."""

import pytest
from plain_kernels import plain_kernels


@pytest.fixture(scope="session")
def plain(interpreted):
    """Return the kernels as ordinary Python, each of which uses the others."""
    found = plain_kernels(interpreted)
    found.prepared_view = interpreted("_prepared_view_kernel")
    found.prepared_view.as_similarity = found.amount.as_similarity
    return found
