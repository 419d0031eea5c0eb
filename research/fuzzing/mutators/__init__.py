"""Mutators of ``python -m research fuzz``: each damages one file in one way.

A mutator takes a random number generator and the bytes of a file and returns other bytes. The ones
that know a format keep the rest of the file whole, with right lengths and checksums, so that what
lies behind them is reached. They may raise any error for a file that is not of their format.
"""

from __future__ import annotations

import random
from collections.abc import Callable

Mutator = Callable[[random.Random, bytes], bytes]
