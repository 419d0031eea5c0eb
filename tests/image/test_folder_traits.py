import cv2
import pytest
from PIL import Image

from fpmatch.errors import DatasetError
from fpmatch.gallery.gallery import open_gallery
from fpmatch.image import folder_traits
from fpmatch.image.dataset_folder import DatasetInfo, read_dataset_info
from fpmatch.image.extract import extract
from fpmatch.image.folder_traits import FolderReader, FolderTraits, find_traits
from fpmatch.image.io.read import read_image
from tests.conftest import ROOT

SAMPLES = [read_image(path).pixels for path in sorted((ROOT / "sample_data").glob("*.tif"))]


def folder_of(root, name, images, dpi=500):
    folder = root / name
    folder.mkdir(exist_ok=True)
    paths = [folder / f"{number}_1.png" for number in range(len(images))]
    for path, image in zip(paths, images, strict=True):
        Image.fromarray(image).save(path, **({"dpi": (dpi, dpi)} if dpi else {}))
    return paths


def resized(images, dpi):
    """Return images of 500 dpi as a sensor of another resolution gives them."""
    by = {"fx": dpi / 500, "fy": dpi / 500}
    how = cv2.INTER_AREA if dpi < 500 else cv2.INTER_CUBIC
    return [cv2.resize(image, None, **by, interpolation=how) for image in images]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", DatasetInfo()),
        ('dpi = 569\nname = "A"\nsensor = "optical"', DatasetInfo("A", 569.0, "optical")),
        ('polarity = "white"', DatasetInfo(polarity="white")),
        ("dpi = 50", "50 dpi"),
        ("dpi = true", "dpi must be a number"),
        ("dpi = ", "not a readable TOML file"),
        ("#" * 2**20 + "#", "not a readable TOML file: more than 1048576 bytes"),
        ('name = "a\\nb"', "name must be text of one line"),
        ('name = " "', "name is empty"),
        ('polarity = "grey"', "no polarity 'grey'"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_a_description_is_read_or_refused_in_one_line(tmp_path, text, expected):
    assert read_dataset_info(tmp_path) == DatasetInfo()
    (tmp_path / "dataset.toml").write_text(text)
    if isinstance(expected, DatasetInfo):
        assert read_dataset_info(tmp_path) == expected
        return
    with pytest.raises(DatasetError, match=rf"dataset\.toml: .*{expected}") as caught:
        read_dataset_info(tmp_path)
    assert "\n" not in str(caught.value)


def test_small_folders_of_one_place_decide_together_unless_a_description_does(
    tmp_path, monkeypatch
):
    one = folder_of(tmp_path, "one", resized(SAMPLES[:1], 330), dpi=None)
    other = folder_of(tmp_path, "other", resized(SAMPLES[1:6], 330), dpi=None)
    looked = []

    def reader(path, **how):
        looked.append(path)
        return read_image(path, **how)

    assert find_traits([*one, *other])[other[0].parent].dpi == pytest.approx(330, rel=0.1)
    monkeypatch.setattr(folder_traits, "MOST_IMAGES", 2)
    places = {path.parent: tmp_path for path in (*one, *other)}
    together = find_traits([*one, *other, tmp_path / "gone.png"], places=places, reader=reader)
    assert together[one[0].parent] == together[other[0].parent]
    assert looked == [*one, other[0], other[-1], tmp_path / "gone.png"]
    (tmp_path / "dataset.toml").write_text('polarity = "white"\ndpi = 260\n')
    for place in (tmp_path, tmp_path / "manifest.csv"):
        described = find_traits(one, places={one[0].parent: place})
        assert described == {one[0].parent: FolderTraits("white")}
    white = FolderReader(read_image, find_traits(one, polarity="white"))(one[0])
    assert (white.pixels == 255 - read_image(one[0]).pixels).all()
    assert FolderReader(read_image, {}, 260)(one[0]).dpi is None


def of_folder(paths, **how):
    """Return the likely resolution of each image, and that of its template."""
    reader = FolderReader(read_image, find_traits(paths, polarity="dark", **how))
    return [(image.likely_dpi, extract(image).dpi) for image in map(reader, paths)]


@pytest.mark.parametrize(("dpi", "expected"), [(330, 330), (360, 360), (500, 500), (569, 500)])
def test_a_folder_without_resolutions_has_one(tmp_path, dpi, expected):
    found = of_folder(folder_of(tmp_path, "a", resized(SAMPLES, dpi), dpi=None))
    assert len(set(found)) == 1
    assert found[0][0] == found[0][1] == pytest.approx(expected, rel=0.1)


def test_prints_alone_or_with_a_resolution_have_no_likely_one(tmp_path):
    small = resized(SAMPLES, 250)
    (alone,) = folder_of(tmp_path, "a", small[:1], dpi=None)
    assert of_folder([alone])[0][0] is None
    stated = folder_of(tmp_path, "b", small, dpi=250)
    assert of_folder(stated) == [(None, 250)] * len(small)
    unstated = folder_of(tmp_path, "c", small, dpi=None)
    assert {likely for likely, _ in of_folder(unstated, dpi=260)} == {None}
    (tmp_path / "c" / "dataset.toml").write_text("dpi = 260\n")
    assert {likely for likely, _ in of_folder(unstated)} == {None}


def test_later_prints_have_the_resolution_of_the_earlier_unless_their_ridges_rule_it_out(tmp_path):
    paths = folder_of(tmp_path, "a", resized(SAMPLES, 350), dpi=None)
    for few in (paths, paths[:1]):
        for earlier in (330, 360, 390):
            assert set(of_folder(few, earlier={tmp_path / "a": earlier})) == {(earlier, earlier)}
    assert of_folder(paths, earlier={tmp_path / "a": 1000}) == of_folder(paths)
    assert of_folder(paths, earlier={tmp_path / "b": 360}) == of_folder(paths)


def test_prints_enrolled_later_have_the_resolution_of_their_folder(run, tmp_path):
    db, images = tmp_path / "a.db", resized(SAMPLES, 350)
    folder_of(tmp_path, "a", images[:-1], dpi=None)
    assert run("enrol", db, tmp_path / "a", "--workers", 1).exit_code == 0
    folder_of(tmp_path, "a", images, dpi=None)
    done = run("enrol", db, tmp_path / "a" / f"{len(images) - 1}_1.png", "--workers", 1)
    with open_gallery(db) as gallery:
        templates = [template for _, template in gallery.templates()]
    (dpi,) = {template.dpi for template in templates}
    assert dpi == pytest.approx(350, rel=0.1)
    assert len(templates) == len(images)
    assert not any(template.dpi_known for template in templates)
    assert f"{dpi:g} dpi by the ridges of the prints with it" in done.stderr
