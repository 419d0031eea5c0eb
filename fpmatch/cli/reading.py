"""Read prints for a command, with nothing on stderr but what fpmatch itself has to say."""

from __future__ import annotations

import os
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from fpmatch.formats.record import TemplateRecord
    from fpmatch.image.io.raw import RawSize
    from fpmatch.image.io.read import GreyImage

STDERR: Final = 2


def read(path: Path, raw: Sequence[RawSize] = (), **how: Any) -> GreyImage:
    """Read an image as `fpmatch.image.io.read.read_image` does, bare pixels of a size in `raw` too.

    Options of that, such as ``polarity``, are passed on.
    """
    from fpmatch.image.io.read import read_image

    with _c_libraries_silenced():
        return read_image(path, raw_sizes=raw, **how)


def read_print(path: Path, raw: Sequence[RawSize] = (), **how: Any) -> GreyImage | TemplateRecord:
    """Read a file as a template if it is one, else as `read` does."""
    from fpmatch.gallery.read_print import read_print as read_either

    return read_either(path, partial(read, raw=raw), **how)


@contextmanager
def _c_libraries_silenced() -> Iterator[None]:
    """Keep off the terminal what libtiff writes to file descriptor 2 about a damaged file.

    The error that `read_image` raises says it in one line. A command has one thread, so nobody
    else's words are lost.
    """
    try:
        kept = os.dup(STDERR)
    except OSError:  # closed by the caller (2>&-): nothing can reach it
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, STDERR)
    try:
        yield
    finally:
        os.dup2(kept, STDERR)
        os.close(kept)
        os.close(nowhere)
