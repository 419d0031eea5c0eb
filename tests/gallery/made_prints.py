"""Prints, entries, an extractor and a matcher whose results are known."""

import sqlite3
import time
from contextlib import closing

import numpy as np

from fpmatch.errors import GalleryError, ImageError
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.listing.prints import ExtractedPrint
from fpmatch.gallery.store.rows import new_entry
from fpmatch.gallery.store.stored_template import pack_template
from fpmatch.matching.result import Comparison, Matcher
from fpmatch.templates.minutiae import Minutiae, Template


def refused(function, *arguments, code, kind=GalleryError, **options):
    """Return the error that refuses a call; it is of a kind and a code, and of one line."""
    import pytest  # worker processes need none

    with pytest.raises(kind) as caught:
        function(*arguments, **options)
    assert caught.value.code == code
    assert "\n" not in str(caught.value)
    return caught.value


def changed(path, statement, *values):
    """Return the rows of a statement of SQL, by which another program changes a gallery."""
    with closing(sqlite3.connect(path)) as connection, connection:
        return connection.execute(statement, values).fetchall()


def flipped(content, place, bits=1):
    """Return bytes with some bits of one of them changed."""
    return content[:place] + bytes([content[place] ^ bits]) + content[place + 1 :]


DAMAGES = {
    "empty": lambda content: b"",
    "something else": lambda content: b"something else",
    "zeros": lambda content: bytes(len(content)),
    "cut off": lambda content: content[:-8],
    "longer": lambda content: content + b"\0",
    "first bit": lambda content: flipped(content, 0),
    "a bit of the header": lambda content: flipped(content, 100),
    "last bit": lambda content: flipped(content, len(content) - 1),
}
"""Functions that damage the content of a file."""


def readable(folder, template):
    """Return whether a run of 32 bytes of a packed template is in any file of a folder."""
    packed = pack_template(template)
    files = [path.read_bytes() for path in folder.rglob("*") if path.is_file()]
    runs = [packed[k : k + 32] for k in range(len(packed) - 31)]
    return any(run in data for data in files for run in runs)


def scattered(seed, count=20, dpi=500.0):
    """Return a template of some minutiae anywhere."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(20, 280, (2, count))
    return Template(Minutiae(x, y, along_ridges(rng, x)), 300, 300, dpi)


def along_ridges(rng, x):
    """Return directions of minutiae, either way along ridges that turn from left to right."""
    return rng.uniform(0, np.pi) + x / 100 + np.pi * rng.integers(0, 2, len(x))


def print_of(finger, impression, dpi=500.0):
    """Return an impression of a finger of 30 minutiae, a few of them missing."""
    rng = np.random.default_rng(finger)
    x, y = rng.uniform(20, 280, (2, 30))
    angle = along_ridges(rng, x)
    kept = np.random.default_rng([finger, impression]).permutation(30)[:27]
    zoom = dpi / 500.0
    size = round(300 * zoom)
    return Template(Minutiae(x[kept] * zoom, y[kept] * zoom, angle[kept]), size, size, dpi)


def entry_of(number, template=None, label=None, **changes):
    """Return a print to enrol, all of whose contents follow its number unless they are given."""
    fields = {
        "label": label or Label(str(number), impression="1"),
        "source": f"/prints/{number}_1.tif",
        "content": number.to_bytes(32, "big"),
        "template": template or scattered(number, 5),
    }
    return new_entry(**{**fields, **changes})


def entries_of(*templates, labels=None):
    """Return prints to enrol, numbered from 1, under their numbers unless labels are given."""
    labels = labels or [Label(str(number)) for number in range(1, len(templates) + 1)]
    numbered = enumerate(zip(templates, labels, strict=True), start=1)
    return [entry_of(number, template, label) for number, (template, label) in numbered]


class FakeMatcher(Matcher):
    """A matcher whose similarities are those of the first minutiae's x."""

    name = "fake"

    def prepare(self, template):
        return float(template.minutiae.x[0])

    def compare(self, probe, reference):
        similarity = max(0.0, 100.0 - abs(probe - reference))
        return Comparison(similarity, None, np.empty((0, 2), np.int32), 0.0, 0.0, 0.0, "fake")


FAKE = FakeMatcher()


def template_at(x):
    """Return the template that the fake matcher knows by `x`."""
    return Template(Minutiae([x], [1], [0]), 300, 300)


def extractor(file):
    """Make one minutia of a picture that is words; refuse or wait where these say so."""
    words = file.path.read_text().split()
    if "broken" in words:
        raise ImageError(f"{file.path}: broken")
    if "slow" in words:
        time.sleep(0.02)
    template = Template(Minutiae([len(words)], [1], [0]), 300, 300, file.dpi or 500.0)
    return ExtractedPrint(template, dpi_assumed=file.dpi is None and "untagged" in words)
