"""`Codec`: what a format module offers to the registry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.minutiae import Template

LARGEST: Final = float(np.finfo(np.float32).max)  # of a coordinate, which templates keep as float32


@dataclass(frozen=True, slots=True)
class Codec:
    """Read and write one format of template file.

    Parameters
    ----------
    name : str
        Name of the format, as the command line takes it.
    suffix : str
        Suffix of its files, with the dot, in lower case.
    recognises : callable
        Tells from a file's bytes whether they are meant to be this format.
    decode : callable
        Makes a Template of a file's bytes; raises an `FpmatchError` that names the reason (and
        the line, where the format has lines) but not the file.
    encode : callable
        Makes a file's bytes of a Template; the same template always gives the same bytes.
    """

    name: str
    suffix: str
    recognises: Callable[[bytes], bool]
    decode: Callable[[bytes], Template]
    encode: Callable[[Template], bytes]
