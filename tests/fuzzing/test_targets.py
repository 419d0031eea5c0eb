"""Targets of `python -m research fuzz`: all readers, each with good files that it reads."""

import pytest

from fpmatch.errors import FpmatchError
from fpmatch.formats.registry import CODECS
from fpmatch.image.io.read import READERS
from research.fuzzing.good_images import IMAGE_KINDS, image_files
from research.fuzzing.loop import Limits, run
from research.fuzzing.targets import all_targets

TARGETS = {target.name: target for target in all_targets()}
FILES = 12  # damaged ones of each target


def test_every_format_of_the_registries_is_a_target():
    assert {codec.name for codec in CODECS} <= set(TARGETS)
    names = {reader.name.lower().replace("ppm", "pnm") for reader in READERS}
    assert names <= set(IMAGE_KINDS)
    assert set(image_files()) == set(IMAGE_KINDS)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(TARGETS))
def test_a_target_reads_its_good_files_and_some_damaged_ones(name):
    target = TARGETS[name]
    reader = target.make()
    assert reader.corpus
    for data in reader.corpus:
        try:
            reader.read(data)
        except FpmatchError as error:
            pytest.fail(f"a good file is refused: {error}")
    count = run(target, reader._replace(corpus=reader.corpus[-3:]), limits=Limits(files=3 + FILES))
    assert [finding.reason for finding in count.findings.values()] == []
    assert count.inputs >= FILES
