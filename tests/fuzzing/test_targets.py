"""Targets of `python -m research fuzz`: all readers, each with good files that it reads."""

import ast
from pathlib import Path

import pytest

import fpmatch
from fpmatch.errors import FpmatchError
from fpmatch.formats.registry import CODECS
from fpmatch.image.io.registry import READERS as IMAGE_READERS
from research.fuzzing.loop import Limits, run
from research.fuzzing.readers import READERS, READING_CALLS
from research.fuzzing.targets import all_targets
from research.fuzzing.targets.good_images import IMAGE_KINDS, image_files

TARGETS = {target.name: target for target in all_targets()}
PACKAGE = Path(fpmatch.__file__).parent
FILES = 12  # damaged ones of each target


def test_every_format_of_the_registries_is_a_target():
    assert {codec.name for codec in CODECS} <= set(TARGETS)
    names = {reader.name.lower().replace("ppm", "pnm") for reader in IMAGE_READERS}
    assert names <= set(IMAGE_KINDS)
    assert {f"image-{kind}" for kind in IMAGE_KINDS} <= set(TARGETS)
    assert set(image_files()) == set(IMAGE_KINDS)


def test_every_module_that_reads_files_has_a_target_or_a_reason():
    reading = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if _reads(path.read_text("utf-8"))
    }
    assert reading == set(READERS), "see research/fuzzing/readers.py"


def test_the_targets_of_readers_are_there():
    named = {name for names in READERS.values() if isinstance(names, tuple) for name in names}
    assert named <= set(TARGETS)


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
    *_, count = run(target, reader._replace(corpus=reader.corpus[-3:]), limits=Limits(files=FILES))
    assert [finding.reason for finding in count.findings.values()] == []
    assert count.damaged == FILES


def _reads(text):
    """Whether a module calls what reads files."""
    if not any(f"{call.rpartition('.')[2]}(" in text for call in READING_CALLS):
        return False
    nodes = ast.walk(ast.parse(text))
    names = {ast.unparse(node.func) for node in nodes if isinstance(node, ast.Call)}
    return bool(READING_CALLS & {*names, *(name.rpartition(".")[2] for name in names)})
