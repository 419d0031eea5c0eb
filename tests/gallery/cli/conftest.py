"""The gallery of the commands' tests is a file; that of the other tests of galleries is open."""

from tests.conftest import gallery  # noqa: F401
