"""Galleries from Python: `fpmatch.enrol` and `fpmatch.identify`."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import fpmatch
from fpmatch.gallery.listing.entry import PrintFile
from fpmatch.gallery.tasks.enrol import enrol

SAMPLES = Path(__file__).parents[3] / "sample_data"
A, B = SAMPLES / "101_1.tif", SAMPLES / "101_3.tif"


def test_a_gallery_is_searched_by_its_name(tmp_path):
    where = tmp_path / "prints.db"
    with fpmatch.open_gallery(where, create=True) as gallery:
        files = [PrintFile(SAMPLES / f"{finger}_1.tif") for finger in (101, 102, 103)]
        enrol(gallery, files)
        (stated,) = fpmatch.identify(gallery, B, count=1, dpi=500)
        with Image.open(B) as image:
            small = np.asarray(image.convert("L").resize([round(0.726 * s) for s in image.size]))
        (unstated,) = fpmatch.identify(gallery, small, count=1)
        assert stated.label.subject == unstated.label.subject == "101"
        assert 40 < unstated.score < stated.score - 10
        assert fpmatch.identify(gallery, small, count=1, dpi=500, threshold=40) == []
    (found,) = fpmatch.identify(where, B, threshold=40)
    assert (found.label.subject, found.score > 40) == ("101", True)
    with pytest.raises(fpmatch.FpmatchError):
        fpmatch.identify(tmp_path / "missing.db", B)


def test_prints_are_enrolled_by_the_names_of_their_folders(tmp_path):
    where, prints = tmp_path / "prints.db", [A, str(B)]
    done = fpmatch.enrol(where, prints, workers=1)
    assert (done.enrolled, done.known, done.failures) == (2, 0, [])
    with fpmatch.open_gallery(where) as gallery:
        assert fpmatch.enrol(gallery, A.parent / "101_1.tif", workers=1).known == 1
        assert len(gallery) == 2
        other = shutil.copy(A.parent / "103_1.tif", tmp_path / "101_8.tif")
        assert len(fpmatch.enrol(gallery, other, workers=1, strict=True).failures) == 1
    with pytest.raises(fpmatch.FpmatchError, match="missing"):
        fpmatch.enrol(where, tmp_path / "missing")
    with pytest.raises(fpmatch.FpmatchError):
        fpmatch.enrol(where, prints, pattern="(")
