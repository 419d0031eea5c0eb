"""What several tests share: templates and pictures of prints that never were."""

import csv
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import settings
from PIL import Image

import fpmatch
from fpmatch.base.kernels import compiled_kernels
from fpmatch.cli.group import fpmatch as main
from fpmatch.matching.constants import COMPILED
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

# `research` and the benchmarks are not installed. The root stands last on the path: it holds the
# sources of `fpmatch`, too, which must not hide the installed package.
ROOT = Path(__file__).parents[1]
sys.path += [str(ROOT / "research" / "benchmarks"), str(ROOT)]

PACKAGE = Path(fpmatch.__file__).parent
KERNEL = re.compile(r"\b_[a-z]\w*_kernel\b(?! import COMPILED\b)")
RUNS_COMPILED = re.compile(
    r"fpmatch\.matching\.(pipeline\._kernels|prints\.(_kernels|prepare ))"
    r"|fpmatch\.gallery\.(index\.(follow|segment|terms)|search import shortlist)"
    r"|matchers\.unit_circle import .*view_of|from kernel_cases|from ablation"
    r"|research\.training\.(evidence_quantiles|score)"
)
# One core may be busy with something else: no deadline on single examples, and the same examples
# in every run. `scripts/test` takes the second profile; interpreted, an example takes longer.
FEW = 15 if all(compiled_kernels().values()) else 6
settings.register_profile("fpmatch", deadline=None, derandomize=True, max_examples=50)
settings.register_profile("few", settings.get_profile("fpmatch"), max_examples=FEW)
settings.load_profile("fpmatch")


def pytest_configure():
    """Refuse to run where the kernels that would be tested are not those of the files."""
    from fpmatch.base.kernels import build_command, outdated_kernels

    if outdated_kernels():
        raise pytest.UsageError(f"kernels out of date: {build_command()}")


def pytest_ignore_collect(collection_path):
    """Leave out the tests of what runs compiled only, where it is not."""
    if COMPILED or not collection_path.match("test_*.py"):
        return None
    return True if RUNS_COMPILED.search(collection_path.read_text("utf-8")) else None


@cache
def has_kernels(path):
    """Return whether a file of tests names a kernel, or its folder in the package has some."""
    folder = PACKAGE.joinpath(*path.relative_to(ROOT / "tests").parts[:-1])
    return any(folder.glob("_*_kernel.py")) or bool(KERNEL.search(path.read_text("utf-8")))


def pytest_collection_modifyitems(items):
    """Mark the tests that `scripts/test --interpreted` runs besides one of each command."""
    for item in items:
        if has_kernels(item.path):
            item.add_marker(pytest.mark.kernels)


@pytest.fixture
def tiny_disk(tmp_path):
    """Return an empty folder on a disk of 64 kB, where this process may mount one."""
    folder = tmp_path / "tiny"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)]
    if (
        not shutil.which("mount")
        or subprocess.run(mount, check=False, capture_output=True).returncode
    ):
        pytest.skip("no disk can be mounted")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.fixture
def rng():
    return np.random.default_rng(20240611)


@pytest.fixture(scope="session", autouse=True)
def kernels_line():
    """Let commands in this process not note that kernels are interpreted: one test does that.

    Return the line that commands in other processes begin with, "" where kernels are compiled.
    """
    from fpmatch.base.kernels import slow_kernels_note

    note = slow_kernels_note()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fpmatch.base.kernels.slow_kernels_note", lambda: None)
        yield f"fpmatch: note: {note}\n" if note else ""


@pytest.fixture
def template(rng):
    """Return a template with every kind of minutia, along a ridge field with holes."""
    n = 30
    x, y = rng.uniform(0, 388, n), rng.uniform(0, 374, n)
    turned, kind, quality = rng.integers(0, 2, n), rng.integers(0, 3, n), rng.integers(0, 101, n)
    mask, orientation = rng.random((23, 24)) < 0.7, rng.uniform(0, np.pi, (23, 24))
    cells = np.minimum(y // 16, 22).astype(int), np.minimum(x // 16, 23).astype(int)
    mask[cells] = True
    minutiae = Minutiae(x, y, orientation[cells] + np.pi * turned, kind, quality)
    field = RidgeField(16.0, np.where(mask, orientation, np.nan), mask)
    return Template(minutiae, 388, 374, 500.0, field)


@pytest.fixture
def whorl():
    """Return a 240 x 220 picture of concentric ridges, 9 px apart, on a white ground."""
    y, x = np.mgrid[:240, :220].astype(float)
    radius = np.hypot(x - 110, (y - 120) * 0.9)
    ridges = 127 + 100 * np.cos(2 * np.pi * radius / 9)
    return np.where(radius < 100, ridges, 255).astype(np.uint8)


def ridge_pattern(seed, height=300, width=280):
    """Return a picture of a finger that never was: arched ridges with 36 minutiae, on white.

    Each minutia is a spiral in the phase of the ridge wave, after Larkin and Fletcher, "A coherent
    framework for fingerprint analysis", Optics Express 15 (2007).
    """
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width].astype(float)
    phase = 2 * np.pi / 9 * np.hypot(x - rng.uniform(60, width - 60), y - height * 1.2)
    for _ in range(36):
        column, row = rng.uniform(40, width - 40), rng.uniform(40, height - 40)
        phase += rng.choice([-1, 1]) * np.arctan2(y - row, x - column)
    inside = ((x - width / 2) / (width / 2 - 8)) ** 2 + ((y - height / 2) / (height / 2 - 8)) ** 2
    return np.where(inside < 1, 127 + 100 * np.cos(phase), 255).astype(np.uint8)


@pytest.fixture(scope="session")
def fingers():
    """Return pictures of two different fingers that never were."""
    return [ridge_pattern(1), ridge_pattern(2)]


@pytest.fixture(scope="session")
def pressed():
    """Return synthetic prints with pores and creases of two fingers, two of each, on white."""
    from fpmatch.lab.synthesis.impression import make_impression
    from fpmatch.lab.synthesis.master import make_master
    from fpmatch.lab.synthesis.presets import PRESETS
    from fpmatch.lab.synthesis.sensor import SENSORS

    sensor = SENSORS["optical-388x374"]
    masters = [make_master(4, finger) for finger in (1, 2)]
    return [
        make_impression(master, number, PRESETS["clean"], sensor).image
        for master in masters
        for number in (1, 2)
    ]


@pytest.fixture
def run_research():
    """Return the function that runs ``python -m research`` in this process."""
    from click.testing import CliRunner

    from research.commands import research

    def run(*words):
        return CliRunner().invoke(research, [*map(str, words)], prog_name="research")

    return run


@pytest.fixture
def run():
    """Return a function that runs ``fpmatch`` with the given words, in this process."""

    def run_words(*words, **options):
        kept = {"FPMATCH_KEY": os.environ.get("FPMATCH_KEY")}  # which --key sets
        runner = CliRunner(env=kept)
        return runner.invoke(main, [*map(str, words)], prog_name="fpmatch", **options)

    return run_words


def assert_refused(result, reason):
    """Check that a command has failed with status 2 and one line on stderr, with a reason."""
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.count("\n") == 1, result.stderr
    line = result.stderr
    assert line.startswith("fpmatch: error: ")
    assert reason in line


@pytest.fixture(scope="session")
def prints(tmp_path_factory, fingers):
    """Return a folder with prints of two fingers, of no finger, and files that are no images."""
    folder = tmp_path_factory.mktemp("prints")
    for number, pixels in enumerate(fingers, start=1):
        Image.fromarray(pixels).save(folder / f"{number}_1.png", dpi=(500, 500))
    Image.fromarray(np.rot90(fingers[0])).save(folder / "1_2.png", dpi=(500, 500))
    Image.fromarray(fingers[0]).save(folder / "untagged.tif")
    blank = np.full((200, 200), 255, np.uint8)
    Image.fromarray(blank).save(folder / "blank.png", dpi=(500, 500))
    noise = np.random.default_rng(5).integers(0, 256, (200, 200), dtype=np.uint8)
    Image.fromarray(noise).save(folder / "noise.png", dpi=(500, 500))
    Image.fromarray(blank[:20, :20]).save(folder / "tiny.png")
    (folder / "huge.pgm").write_bytes(b"P5 20000 20000 255\n")
    (folder / "empty.png").touch()
    (folder / "text.png").write_text("This is not an image.\n")
    whole = (folder / "1_1.png").read_bytes()
    (folder / "truncated.png").write_bytes(whole[: len(whole) // 2])
    (folder / "folder.png").mkdir()
    return folder


@pytest.fixture(scope="session")
def gallery(tmp_path_factory, prints):
    """Return a gallery of two prints of finger 1 and one of finger 2."""
    from fpmatch.gallery.engine.engine import serial
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.listing.prints import find_prints
    from fpmatch.gallery.tasks.enrol import enrol

    place = tmp_path_factory.mktemp("gallery") / "prints.db"
    with open_gallery(place, create=True) as opened:
        files = find_prints(prints / name for name in ("1_1.png", "2_1.png", "1_2.png"))
        assert enrol(opened, files, engine=serial()).enrolled == 3
    return place


def rows_of(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def copied(prints, folder, *names, **renamed):
    """Make a folder of copies of prints, those of `renamed` under other names."""
    folder.mkdir()
    for name in names:
        shutil.copy(prints / name, folder)
    for stem, name in renamed.items():
        shutil.copy(prints / name, folder / f"{stem.removeprefix('_')}{Path(name).suffix}")
    return folder


def leaves(command, path=()):
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from leaves(below, (*path, name))
    else:
        yield " ".join(path)
