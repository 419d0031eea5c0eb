"""The figures of a case study show the results, and less where there are fewer."""

import io
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch.errors import OutputError
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.lab.paper_figures.sheet import STYLE
from fpmatch.lab.plots.style import plain_style
from fpmatch.matching.verify import verify
from fpmatch.templates.minutiae import Minutiae
from research.case_study import prints
from research.case_study.case import Case
from research.case_study.command import draw_case_study

pytestmark = pytest.mark.slow
SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
NAMES = ("103_1", "103_2")


@pytest.fixture(scope="module")
def case():
    pytest.importorskip("matplotlib")
    images = [read_image(SAMPLES / f"{name}.tif") for name in NAMES]
    templates = [extract(image) for image in images]
    probe, reference = zip(NAMES, [image.pixels for image in images], strict=True)
    return Case.of(probe, reference, verify(*templates), verify(*templates, matcher="paper"))


def without(case, pairs):
    """Return a case of fewer pairs; of none, and no transform."""

    def fewer(result):
        transform = result.transform if pairs else None
        found = replace(result.comparison, pairs=result.pairs[:pairs], transform=transform)
        return replace(result, comparison=found, explanation=None)

    return replace(case, default=fewer(case.default), paper=fewer(case.paper))


def test_the_figures_are_those_of_the_steps_and_always_the_same(case):
    figures = draw_case_study(case)
    assert [figure.file_name.removesuffix(".png") for figure in figures] == [
        "figure_1_prints", "figure_3_triangulations", "pairs", "mesh_of_pairs", "ring_of_pairs",
        "ring_of_minutiae", "figure_8_overlays",
    ]  # fmt: skip
    for figure in figures:
        with Image.open(io.BytesIO(figure.content)) as image:
            assert image.width == 1600
            assert image.info["Description"] == figure.caption
    assert draw_case_study(case) == figures


def test_the_captions_have_the_numbers_of_the_results(case):
    default, paper = (set(map(tuple, r.pairs.tolist())) for r in case.results.values())
    with plain_style(STYLE):
        caption = prints.pairs(case).caption.replace(";", "")
        for count in (len(default), len(paper), len(default & paper)):
            assert f" {count} " in caption
        assert f"{len(case.probe.mesh.edges)} edges" in prints.triangulations(case).caption
        caption = prints.overlays(case).caption
    for result in case.results.values():
        assert f"scale {result.transform.scale:.3f}" in caption
        assert f"{abs(result.transform.rotation_deg):.1f}° clockwise" in caption


def test_prints_are_upright_and_contain_their_marks(case):
    with plain_style(STYLE):
        for axes, side in zip(prints.prints(case).figure.axes, case.sides, strict=True):
            bottom, top = axes.get_ylim()
            left, right = axes.get_xlim()
            assert bottom > top  # y of an image points down
            x, y = side.points.T
            assert left < x.min() < x.max() < right
            assert top < y.min() < y.max() < bottom
            (image,) = axes.get_images()
            assert image.get_array().shape == side.pixels.shape


def test_mirrored_triangles_and_those_without_area_are_turned_over():
    p = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    line = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    turned = [prints.turned_over(np.array([[0, 1, 2]]), p, q) for q in (2 * p, -p[:, ::-1], line)]
    assert np.ravel(turned).tolist() == [False, True, True]


@pytest.mark.parametrize("pairs", [0, 1, 2, 3])
def test_figures_without_content_are_left_out(case, pairs):
    few = without(case, pairs)
    names = [figure.file_name for figure in draw_case_study(few)]
    assert "figure_8_overlays.png" in names
    assert "ring_of_pairs.png" not in names
    with plain_style(STYLE):
        assert ("no transform found" in prints.overlays(few).caption) == (pairs == 0)


def test_prints_without_minutiae_or_ridges_are_drawn(case):
    empty = [replace(side.template, minutiae=Minutiae.empty(), field=None) for side in case.sides]
    found = verify(*empty), verify(*empty, matcher="paper")
    probe, reference = ((side.name, side.pixels) for side in case.sides)
    assert draw_case_study(Case.of(probe, reference, *found))


def test_an_unknown_format_is_refused(case):
    with pytest.raises(OutputError, match="unknown format 'pdf'"):
        draw_case_study(case, "pdf")  # type: ignore[arg-type]


def test_the_first_two_impressions_of_a_folder_are_drawn(tmp_path, run_research):
    pytest.importorskip("matplotlib")
    folder = tmp_path / "DB1_B"
    folder.mkdir()
    for name in ("102_1", "102_3", "103_1"):
        shutil.copy(SAMPLES / f"{name}.tif", folder)
    done = run_research("case-study", folder, "--out", tmp_path / "out", "--format", "svg")
    assert done.exit_code == 0, done.stderr
    drawn = (tmp_path / "out" / "figure_1_prints.svg").read_text(encoding="utf-8")
    assert "P, the probe: 102_1" in drawn
    assert "Q, the reference: 102_3" in drawn
    assert len(list((tmp_path / "out").iterdir())) == len(done.stdout.splitlines())


def test_bad_input_is_said_in_one_line(tmp_path, run_research):
    single = tmp_path / "single"
    single.mkdir()
    shutil.copy(SAMPLES / "101_1.tif", single)
    for words, reason in (
        ((tmp_path / "none",), "no such folder"),
        ((SAMPLES, "--pair", "101_1", "999_9"), "contains no print 999_9"),
        ((single,), "contains one impression of its first finger"),
    ):
        done = run_research("case-study", *words, "--out", tmp_path / "out")
        assert (done.exit_code, done.stdout) == (2, "")
        assert reason in done.stderr
        assert done.stderr.count("\n") == 1
