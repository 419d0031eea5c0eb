"""Templates as a database: they are compared as they are."""

import pytest

from fpmatch import extract, save_template
from fpmatch.errors import DatasetError
from fpmatch.gallery.batch.sources import unpack
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.lab.evaluation.databases.extraction import DatasetSource
from fpmatch.lab.evaluation.run import evaluate


def test_templates_are_compared_as_they_are(pressed, tmp_path):
    templates = [extract(one, 500) for one in pressed]  # of two fingers, two of each
    folder, mixed = tmp_path / "json", tmp_path / "mixed"
    folder.mkdir()
    mixed.mkdir()
    for k, template in enumerate(templates):
        name = f"{k // 2 + 1}_{k % 2 + 1}"
        save_template(folder / f"{name}.json", template)
        save_template(mixed / f"{name}{('.iso', '.xyt', '.csv', '.ansi')[k]}", template)
    read = DatasetSource(load_dataset(folder)).templates(serial(), range(4))
    assert [unpack(one.data) for one in read] == templates
    for where in (folder, mixed):
        report = evaluate([where], workers=1)
        assert (report.genuine, report.impostor, report.pooled.eer) == (2, 4, 0)


def test_a_gallery_is_refused_with_the_reason(tmp_path):
    with open_gallery(tmp_path / "prints.db", create=True):
        pass
    with pytest.raises(DatasetError, match=r"prints\.db: a gallery is compared by fpmatch score"):
        load_dataset(tmp_path / "prints.db")
