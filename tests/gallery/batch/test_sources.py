"""`fpmatch.gallery.batch.sources`: folders and galleries as sides; exact templates in bytes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch import extract, verify
from fpmatch.errors import FpmatchError, ScoringError
from fpmatch.gallery.batch.score import score
from fpmatch.gallery.batch.sources import (
    FolderSource,
    GallerySource,
    open_source,
    pack,
    unpack,
)
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.store.gallery import Gallery
from fpmatch.gallery.store.rows import new_entry
from fpmatch.gallery.store.stored_template import pack_template, unpack_template
from fpmatch.templates.minutiae import Minutiae, Template


@pytest.fixture
def folder(tmp_path, fingers):
    folder = tmp_path / "prints"
    folder.mkdir()
    Image.fromarray(fingers[0]).save(folder / "10_1.png", dpi=(500, 500))
    Image.fromarray(np.rot90(fingers[0])).save(folder / "9_1.png")
    (folder / "any name, really.tif").write_text("no image")
    (folder / "notes.txt").touch()
    return folder


@pytest.fixture
def gallery(tmp_path, template):
    path = tmp_path / "prints.db"
    with open_gallery(path, create=True) as opened:
        opened.add(
            [
                new_entry(label, str(n), bytes([n]) * 32, replace(template, width=300 + n))
                for n, label in enumerate(
                    [Label("ada", "1", "1"), Label("bob", "", "2"), Label("bob_2")]
                )
            ]
        )
    return path


def test_templates_come_back_exactly(template):
    for original in (template, replace(template, field=None, dpi=569.25)):
        found = unpack(pack(original))
        assert found == original
        assert found.minutiae == original.minutiae
    data = pack_template(template)  # that of a gallery
    assert unpack(data) == unpack_template(data)


def test_damaged_stored_templates_are_one_error():
    data = pack(Template(Minutiae([1, 2], [3, 4], [0, 1]), 20, 30))
    for k in range(len(data)):
        flipped = data[:k] + bytes([data[k] ^ 1]) + data[k + 1 :]
        for damaged in (flipped, data[:k]):
            with pytest.raises(FpmatchError, match=r"damaged|not a packed template"):
                unpack(damaged)


def test_a_folder_by_name_with_its_failures(folder):
    side = open_source(folder)
    assert isinstance(side, FolderSource)
    assert side.names == ["9_1.png", "10_1.png", "any name, really.tif"]
    untagged, tagged, failed = side.templates(serial(), range(3))
    assert (untagged.dpi_assumed, tagged.dpi_assumed) == (True, False)
    assert unpack(tagged.data).minutiae == extract(folder / "10_1.png").minutiae
    assert (failed.data, failed.reason) == (None, "not an image of a known format")
    assert next(side.templates(serial(), [2])) == failed
    items = list(open_source(folder, dpi=569).templates(serial(), range(3)))
    assert [unpack(item.data).dpi for item in items if item.data] == [569, 569]
    assert not any(item.dpi_assumed for item in items)
    (folder / "10_1.png").unlink()
    assert next(side.templates(serial(), [1])).reason == "no such file"


def test_the_content_hash_tells_of_changes(folder):
    before = open_source(folder).content_hash
    assert open_source(folder).content_hash == before
    assert open_source(folder, dpi=569).content_hash != before
    (folder / "any name, really.tif").write_text("no image either")
    assert open_source(folder).content_hash != before


def test_a_gallery_by_number(gallery):
    side = open_source(str(gallery))
    assert isinstance(side, GallerySource)
    assert side.names == ["ada_1_1", "bob_2#2", "bob_2#3"]
    assert [unpack(item.data).width for item in side.templates(serial(), [0, 2])] == [300, 302]
    with open_gallery(gallery) as opened:
        opened.remove([2])
    with pytest.raises(ScoringError, match=r"prints.db: changed while it was read; start again"):
        list(side.templates(serial(), range(3)))


def test_of_a_gallery_the_entries_of_some_names(gallery, tmp_path, monkeypatch):
    """Listed pairs read no other labels; a name that several have has the number behind it."""
    listed = tmp_path / "list.csv"
    listed.write_text("bob_2#3,ada_1_1\n")
    with monkeypatch.context() as patch:
        patch.delattr(Gallery, "entries")
        side = GallerySource(gallery, {"ada_1_1", "bob_2#3", "eve"})
        assert side.names == ["ada_1_1", "bob_2#2", "bob_2#3"]
        assert GallerySource(gallery, {"ada_1_1"}).names == ["ada_1_1"]
        assert score(gallery, gallery, tmp_path / "listed.csv", pairs=listed).rows == 1
    score(gallery, gallery, tmp_path / "all.csv")
    (line,) = (tmp_path / "listed.csv").read_text().splitlines()[1:]
    assert line in (tmp_path / "all.csv").read_text().splitlines()
    before = side.content_hash
    assert before != GallerySource(gallery, {"ada_1_1"}).content_hash
    with open_gallery(gallery) as opened:
        label = Label("=1", "", "")
        opened.add([new_entry(label, "n", bytes([9]) * 32, replace(opened.template(1), width=400))])
    assert GallerySource(gallery, {r"\x3d1"}).names == GallerySource(gallery, {"=1"}).names
    assert GallerySource(gallery, {"=1"}).names == [r"\x3d1"]


@pytest.mark.parametrize(
    "place", ["nowhere", "notes.txt", "empty", "empty.db", "mysql://host/prints"]
)
def test_what_is_no_side(tmp_path, place):
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("no gallery")
    open_gallery(tmp_path / "empty.db", create=True).close()
    with pytest.raises(FpmatchError) as raised:
        open_source(place if "://" in place else tmp_path / place)
    assert "\n" not in str(raised.value)


def test_scores_are_those_of_verify(folder, tmp_path):
    score(folder, folder, tmp_path / "scores.csv")
    probe, reference = (extract(Path(folder, name)) for name in ("9_1.png", "10_1.png"))
    assert isinstance(probe, Template)
    line = next(
        line
        for line in (tmp_path / "scores.csv").read_text().splitlines()
        if ",9_1.png,10_1.png," in line
    )
    assert float(line.split(",")[6]) == verify(probe, reference).score
