"""`Codec`: what a format module offers to the registry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

LARGEST: Final = float(np.finfo(np.float32).max)  # of a coordinate, which templates keep as float32


@dataclass(frozen=True, slots=True)
class Codec:
    """Read and write one format of template file.

    Parameters
    ----------
    name : str
        Name of the format, as the command line takes it.
    title : str
        Its full name, for people.
    suffixes : tuple of str
        Suffixes of its files, with the dot, in lower case; the first is the one to write.
    recognises : callable
        Returns whether a file's bytes, or its first few thousand, are meant to be this format.
    decode : callable
        Makes a TemplateRecord of a file's bytes under `ReadingOptions`; raises an `FpmatchError`
        that names the reason (and the line, where the format has lines) but not the file.
    encode : callable or None
        Makes a file's bytes of a TemplateRecord; the same record always gives the same bytes. None
        where the format is only read.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool]
    decode: Callable[[bytes, ReadingOptions], TemplateRecord]
    encode: Callable[[TemplateRecord], Encoded] | None = None
