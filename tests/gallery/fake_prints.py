"""Pictures that are words: what the fake extractor makes of them is known."""

from __future__ import annotations

import time

from fpmatch.errors import ImageError
from fpmatch.gallery.prints import ExtractedPrint, PrintFile
from fpmatch.minutiae import Minutiae, Template


def extractor(file: PrintFile) -> ExtractedPrint:
    """Refuse what says so, wait where it says so, and make one minutia of anything else."""
    words = file.path.read_text().split()
    if "broken" in words:
        raise ImageError(f"{file.path}: broken")
    if "slow" in words:
        time.sleep(0.02)
    template = Template(Minutiae([len(words)], [1], [0]), 300, 300, file.dpi or 500.0)
    return ExtractedPrint(template, dpi_assumed=file.dpi is None and "untagged" in words)
