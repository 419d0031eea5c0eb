"""Images of small sensors, 96 by 103 pixels, whose file states a resolution that is not theirs."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from fpmatch.cli.group import fpmatch
from fpmatch.image.extract import assess

SAMPLE = Path(__file__).parents[3] / "sample_data" / "101_1.tif"
SIZE = (96, 103)


def shrunk(factor):
    """Return the middle of a sample print, of 500 dpi, as an image of 500 / `factor` dpi."""
    with Image.open(SAMPLE) as whole:
        centre = np.array(whole.size) / 2
        half = factor * np.array(SIZE) / 2
        part = whole.convert("L").crop((*(centre - half).tolist(), *(centre + half).tolist()))
        return np.asarray(part.resize(SIZE, Image.Resampling.LANCZOS))


@pytest.mark.parametrize("factor", [1.5, 2.0, 2.5, 3.0, 3.6])
def test_the_likely_resolution_is_named(factor):
    (reason,) = assess(shrunk(factor), 500).quality.reasons
    assert reason.code == "wrong resolution"
    assert reason.dpi == pytest.approx(500 / factor, rel=0.1)
    assert f"about {reason.dpi:.0f} dpi" in reason.message
    assert not any(
        r.code == reason.code for r in assess(shrunk(factor), reason.dpi).quality.reasons
    )


def test_a_small_image_of_nothing_keeps_its_reasons():
    noise = np.random.default_rng(3).integers(0, 256, SIZE[::-1], dtype=np.uint8)
    for image in (noise, np.full(SIZE[::-1], 200, np.uint8)):
        codes = [reason.code for reason in assess(image, 500).quality.reasons]
        assert codes == ["no ridges", "too small"]


@pytest.fixture
def folder(tmp_path):
    """Return a folder of small images without a resolution."""
    made = tmp_path / "small"
    made.mkdir()
    for finger, factor in ((1, 2.0), (2, 3.6)):
        Image.fromarray(shrunk(factor)).save(made / f"{finger}_1.bmp")
        Image.fromarray(shrunk(factor)[::-1]).save(made / f"{finger}_2.bmp")
    return made


def test_inspect_names_it_and_takes_it(folder):
    found = CliRunner().invoke(fpmatch, ["inspect", str(folder / "1_1.bmp")])
    assert "resolution unknown, quality 0; wrong resolution: " in found.output
    assert "about 240 dpi" in found.output
    words = ["inspect", str(folder / "1_1.bmp"), "--dpi", "240"]
    stated = CliRunner().invoke(fpmatch, words).output
    assert ", 240 dpi, quality " in stated
    assert "wrong resolution" not in stated
    (document,) = json.loads(CliRunner().invoke(fpmatch, [*words, "--json"]).output)
    assert document["image"]["dpi"] == 240
    assert document["image"]["quality"]["score"] > 40
    assert CliRunner().invoke(fpmatch, [*words[:-1], "20"]).exit_code == 2


@pytest.mark.parametrize("words", [["enrol", "prints.db"], ["evaluate"]])
def test_batches_name_it_where_they_find_no_minutiae(folder, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(fpmatch, [*words, str(folder), "--workers", "1"])
    assert "1_1.bmp: no minutiae found; wrong resolution: ridges lie 4.4 px apart" in done.stderr
