"""The gallery of the commands' tests is a file; that of the other tests of galleries is open."""

import pytest

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Failure, Label
from fpmatch.gallery.store.rows import new_entry
from fpmatch.templates.minutiae import Minutiae, Template
from tests.conftest import gallery  # noqa: F401


@pytest.fixture
def place(tmp_path):
    """Return a gallery of three impressions of two subjects, one of them strangely named."""
    labels = [Label("1", "", "1"), Label("1", "", "2"), Label("a/b", "thumb", "1")]
    new = [
        new_entry(
            label,
            f"/prints/{k}.tif",
            k.to_bytes(32, "big"),
            Template(Minutiae([k], [1], [0]), 300, 300, 500.0 if k else 569.0),
        )
        for k, label in enumerate(labels)
    ]
    with open_gallery(tmp_path / "prints.db", create=True) as opened:
        opened.add(new, [Failure("/prints/9.tif", "no minutiae found")])
    return tmp_path / "prints.db"
