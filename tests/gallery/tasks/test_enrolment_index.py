"""The index of a large gallery grows while prints are enrolled, a full segment at a time."""

import pytest
from made_prints import scattered

from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.index.gallery_index import GalleryIndex
from fpmatch.gallery.listing.prints import ExtractedPrint, find_prints
from fpmatch.gallery.tasks import enrol as enrol_module
from fpmatch.gallery.tasks import enrolment_index, transfer
from fpmatch.gallery.tasks.enrol import enrol
from fpmatch.matching.matchers.unit_circle import MATCHER

SIZE = 60
FULL = 16  # prints of a segment


@pytest.fixture(autouse=True)
def small_limits(monkeypatch):
    """Index galleries of more than 40 prints, and look for full segments every five prints."""
    monkeypatch.setattr("fpmatch.gallery.index.loss.EXHAUSTIVE_UP_TO", 40)
    for module in ("gallery_index", "state"):
        monkeypatch.setattr(f"fpmatch.gallery.index.{module}.MOST_PRINTS", FULL)
    monkeypatch.setattr(enrolment_index, "PRINTS_PER_CHECK", 5)
    monkeypatch.setattr(enrol_module, "PRINTS_PER_COMMIT", 2)
    monkeypatch.setattr(transfer, "ENTRIES_PER_COMMIT", 2)


@pytest.fixture
def built(monkeypatch):
    """Return the list of how many prints each segment was built of."""
    sizes, build = [], GalleryIndex._built

    def noting(self, rows, *rest):
        sizes.append(len(rows))
        return build(self, rows, *rest)

    monkeypatch.setattr(GalleryIndex, "_built", noting)
    return sizes


@pytest.fixture
def files(tmp_path):
    """Return the prints of a folder, whose contents are their numbers."""
    folder = tmp_path / "prints"
    folder.mkdir()
    for number in range(SIZE):
        (folder / f"{number:02d}_1.tif").write_text(str(number))
    return find_prints([folder])


def extractor(file):
    return ExtractedPrint(scattered(int(file.path.read_text()), 12), dpi_assumed=False)


def stop_at(most):
    def progress(stage, done, total):
        if stage == "enrol" and done >= most:
            raise KeyboardInterrupt

    return progress


def sizes_of(gallery):
    """Return the sizes of the segments of an index that another process opens."""
    state = GalleryIndex(gallery, MATCHER, engine=serial()).refresh()
    assert state.numbers.tolist() == [number for number, _ in gallery.templates()]
    return [part.listed.prints for part in state.parts]


def test_an_interrupted_enrolment_leaves_an_index_of_all_full_segments(gallery, files, built):
    options = {"engine": serial(), "extractor": extractor}
    with pytest.raises(KeyboardInterrupt):
        enrol(gallery, files, progress=stop_at(54), **options)
    assert (len(gallery), built) == (54, [FULL, FULL, FULL])
    assert enrol(gallery, files, **options).enrolled == 6
    assert built[3:] == [12]
    assert sizes_of(gallery) == [FULL, FULL, FULL, 12]
    assert len(built) == 4
