from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from fpmatch.errors import DatasetError, ImageError, ImageReadError, ResolutionError, TemplateError
from fpmatch.formats.files import load_template, save_template
from fpmatch.gallery.listing.entry import PrintFile
from fpmatch.gallery.listing.prints import extract_print, find_prints
from fpmatch.templates.minutiae import Minutiae


@pytest.fixture
def folder(tmp_path):
    for name in ("10_1.tif", "9_1.tif", "notes.txt", "a_x.png"):
        (tmp_path / name).touch()
    return tmp_path


def test_folders_are_their_images_and_files_are_themselves(folder):
    found = find_prints([folder / "notes.txt", folder, folder / "9_1.tif"])
    assert [file.path.name for file in found] == ["notes.txt", "9_1.tif", "10_1.tif", "a_x.png"]
    assert {file.dpi for file in found} == {None}
    assert {file.dpi for file in find_prints([folder], 1000)} == {1000}


def test_what_is_not_there_is_refused(folder):
    with pytest.raises(ImageReadError, match=r"9_2\.tif: no such file or folder"):
        find_prints([folder, folder / "9_2.tif"])
    (folder / "empty").mkdir()
    with pytest.raises(
        ImageReadError, match="empty: the folder contains no images and no templates"
    ):
        find_prints([folder / "empty"])
    with pytest.raises(ResolutionError, match="50 dpi"):
        find_prints([folder], 50)
    (folder / "dataset.toml").write_text("dpi = 1\n")
    with pytest.raises(DatasetError, match="resolution of 1 dpi"):
        find_prints([folder])


def test_a_template_tells_whether_its_resolution_was_assumed(tmp_path, fingers):
    tagged, untagged = tmp_path / "tagged.png", tmp_path / "untagged.png"
    Image.fromarray(fingers[0]).save(tagged, dpi=(500, 500))
    Image.fromarray(fingers[0]).save(untagged)
    assert not extract_print(PrintFile(tagged)).dpi_assumed
    assert extract_print(PrintFile(untagged)).dpi_assumed
    extracted = extract_print(PrintFile(untagged, 569.0))
    assert not extracted.dpi_assumed
    assert extracted.template.dpi == 569.0
    Image.fromarray(np.full((200, 200), 255, np.uint8)).save(untagged)
    with pytest.raises(ImageError, match=r"untagged\.png: no minutiae found"):
        extract_print(PrintFile(untagged))


def test_a_folder_without_images_is_its_templates_one_of_each_name(tmp_path, template):
    for name in ("2_1.json", "2_1.csv", "10_1.iso", "1_1.csv", "1_1.iso", ".3_1.iso"):
        save_template(tmp_path / name, template)
    (tmp_path / "scores.csv").write_text("probe,reference,score\n")
    (tmp_path / "notes.json").write_text("[]")
    (tmp_path / "README.txt").write_text("templates of 2002, one finger a number\n")
    (tmp_path / "11_1.iso").write_text("what a damaged disk left of a template")
    assert [file.path.name for file in find_prints([tmp_path])] == [
        "10_1.iso",
        "11_1.iso",
        "1_1.csv",
        "2_1.json",
    ]
    (tmp_path / "1_1.png").touch()
    assert [file.path.name for file in find_prints([tmp_path])] == ["1_1.png"]


@pytest.mark.parametrize(
    "damage", [b"", b"\x00" * 20, b"\xff\xfe\xfd\xfc" * 10, b"<html>404</html>\n"]
)
@pytest.mark.parametrize("suffix", [".json", ".csv"])
def test_damaged_ones_beside_templates_are_not_passed_over(tmp_path, template, suffix, damage):
    (tmp_path / f"2_1{suffix}").write_bytes(damage)
    with pytest.raises(ImageReadError, match="no images and no templates"):
        find_prints([tmp_path])
    save_template(tmp_path / "1_1.json", template)
    names = [file.path.name for file in find_prints([tmp_path])]
    assert names == ["1_1.json", f"2_1{suffix}"]


@pytest.mark.parametrize("suffix", [".json", ".iso", ".ansi", ".xyt"])
def test_a_template_is_taken_as_it_is(tmp_path, template, suffix):
    path = tmp_path / f"print{suffix}"
    save_template(path, template)
    extracted = extract_print(PrintFile(path))
    assert len(extracted.template.minutiae) == len(template.minutiae)
    assert extracted.template == load_template(path)
    assert extracted.dpi_assumed is (suffix == ".xyt")
    at_1000_dpi = extract_print(PrintFile(path, 1000.0))
    assert (at_1000_dpi.template.dpi, at_1000_dpi.dpi_assumed) == (1000, False)


def test_a_damaged_or_empty_template_is_no_print(tmp_path, template):
    path = tmp_path / "print.tif"
    save_template(path, replace(template, minutiae=Minutiae.empty()), file_format="iso2005")
    with pytest.raises(ImageError, match=r"print\.tif: no minutiae found"):
        extract_print(PrintFile(path))
    save_template(path, template, file_format="iso2005")
    path.write_bytes(path.read_bytes()[:50])
    with pytest.raises(TemplateError, match=r"print\.tif: cut short"):
        extract_print(PrintFile(path))
