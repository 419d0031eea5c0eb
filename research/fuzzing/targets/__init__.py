"""Targets of ``python -m research fuzz``: every reader of fpmatch.

A new reader is a line in one of the modules here, or needs none where a registry lists it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from research.fuzzing.targets.arrays import array_targets
from research.fuzzing.targets.prints import print_targets
from research.fuzzing.targets.server import server_targets
from research.fuzzing.targets.stores import store_targets
from research.fuzzing.targets.tables import text_targets

if TYPE_CHECKING:
    from research.fuzzing.target import Target


def all_targets() -> list[Target]:
    """Return the targets of all readers; their good files are made when they are needed."""
    makers = (print_targets, text_targets, store_targets, array_targets, server_targets)
    return [target for make in makers for target in make()]
