"""What the command-line tests share: prints as files, and a way to run commands on them."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner, Result
from numpy.typing import NDArray
from PIL import Image

from fpmatch.cli.group import fpmatch as main
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.gallery.tasks.enrol import enrol

Run = Callable[..., Result]


@pytest.fixture
def run() -> Run:
    """Return a function that runs ``fpmatch`` with the given words, in this process."""

    def run_words(*words: object, **options: Any) -> Result:
        return CliRunner().invoke(main, [*map(str, words)], prog_name="fpmatch", **options)

    return run_words


def assert_refused(result: Result, reason: str) -> None:
    """Check that a command has failed with status 2 and one line on stderr, with a reason."""
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.count("\n") == 1, result.stderr
    line = result.stderr
    assert line.startswith("fpmatch: error: ")
    assert reason in line


@pytest.fixture(scope="session")
def prints(tmp_path_factory: pytest.TempPathFactory, fingers: list[NDArray[np.uint8]]) -> Path:
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
def gallery(tmp_path_factory: pytest.TempPathFactory, prints: Path) -> Path:
    """Return a gallery of two prints of finger 1 and one of finger 2."""
    place = tmp_path_factory.mktemp("gallery") / "prints.db"
    with open_gallery(place, create=True) as opened:
        files = find_prints(prints / name for name in ("1_1.png", "2_1.png", "1_2.png"))
        assert enrol(opened, files, engine=serial()).enrolled == 3
    return place


def rows_of(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file."""
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def copied(prints: Path, folder: Path, *names: str, **renamed: str) -> Path:
    """Make a folder of copies of prints, those of `renamed` under other names."""
    folder.mkdir()
    for name in names:
        shutil.copy(prints / name, folder)
    for stem, name in renamed.items():
        shutil.copy(prints / name, folder / f"{stem.removeprefix('_')}{Path(name).suffix}")
    return folder


def leaves(command: click.Command, path: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield the full names of the commands below a group."""
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from leaves(below, (*path, name))
    else:
        yield " ".join(path)
