"""Databases in every form: the same prints give the same results, whatever their fingers' names."""

import pytest

from fpmatch import extract, save_template
from fpmatch.errors import DatasetError
from fpmatch.gallery.batch.sources import unpack
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.store.rows import new_entry
from fpmatch.lab.evaluation.calibrate import gather_impostors
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.lab.evaluation.databases.extraction import DatasetSource, extract_image
from fpmatch.lab.evaluation.run import evaluate


@pytest.fixture
def templates(pressed):
    """Return the templates of two fingers, two impressions of each."""
    return {f"{k // 2 + 1}_{k % 2 + 1}": extract(one, 500) for k, one in enumerate(pressed)}


def test_templates_and_galleries_are_compared_as_they_are(templates, tmp_path):
    folder, mixed = tmp_path / "json", tmp_path / "mixed"
    folder.mkdir()
    mixed.mkdir()
    entries = []
    for k, (name, template) in enumerate(templates.items()):
        save_template(folder / f"{name}.json", template)
        save_template(mixed / f"{name}{('.iso', '.xyt', '.csv', '.ansi')[k]}", template)
        label = Label("ada", "left" if k < 2 else "right", name)
        entries.append(new_entry(label, f"{name}.json", bytes([k]) * 32, template))
    place = tmp_path / "prints.db"
    with open_gallery(place, create=True) as gallery:
        gallery.add(entries[::-1])
    by_file, by_entry = (evaluate([where], workers=1) for where in (folder, place))
    assert (by_file.genuine, by_file.impostor) == (by_entry.genuine, by_entry.impostor) == (2, 4)
    assert by_entry.sets[0].scores.prints[:2] == ("ada_left_1_1", "ada_left_1_2")
    read = DatasetSource(load_dataset(folder)).templates(serial(), range(4))
    assert [unpack(one.data) for one in read] == list(templates.values())
    assert by_entry.pooled.eer == by_file.pooled.eer == 0
    assert evaluate([mixed], workers=1).pooled.eer == 0
    assert gather_impostors([place])[0].similarity.size == 4
    with open_gallery(place) as gallery:
        dataset = load_dataset(place)
        gallery.remove([gallery.numbers_of("ada")[0]])
    with pytest.raises(DatasetError, match="has been removed meanwhile"):
        evaluate(dataset, workers=1)


def test_a_template_at_another_resolution_and_one_of_several_prints(template, tmp_path):
    save_template(tmp_path / "1_1.xyt", template)
    assert extract_image(tmp_path / "1_1.xyt", None).dpi_assumed
    assert extract_image(tmp_path / "1_1.xyt", 1000).template.dpi == 1000
