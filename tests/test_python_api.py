"""What Python programs type and see: short texts, notebooks, pictures that are saved."""

import dataclasses
import shutil
import socket
from contextlib import suppress
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import fpmatch
from fpmatch import Minutia, MinutiaKind
from fpmatch.errors import OutputError

SAMPLES = Path(__file__).parents[1] / "sample_data"
A, B = SAMPLES / "101_1.tif", SAMPLES / "101_3.tif"
EVIL = "<script>alert(1)</script>"
MOST_LETTERS = 300


@pytest.fixture(scope="module")
def template():
    return fpmatch.extract(A)


@pytest.fixture(scope="module")
def result():
    return fpmatch.verify(A, B)


def test_a_print_verified_with_itself_is_identical(template, result):
    assert result.identical is None
    itself = fpmatch.verify(A, fpmatch.read_image(A).pixels)
    assert (itself.match, itself.identical) == (True, "pixels")
    assert "the two images have the same pixels" in itself._repr_html_()
    assert fpmatch.verify(A, template).identical == "template"


def test_minutiae_are_a_sequence(template):
    minutiae = template.minutiae
    assert len(template) == len(minutiae) == len(list(minutiae))
    first = minutiae[0]
    assert first == next(iter(minutiae)) == minutiae[-len(minutiae)]
    assert isinstance(first, Minutia)
    assert first.kind in MinutiaKind
    assert (first.x, first.y) == tuple(minutiae.xy[0].tolist())
    assert minutiae[:3] == minutiae[[0, 1, 2]] == minutiae.take([0, 1, 2])
    assert len(minutiae[minutiae.kind == MinutiaKind.ENDING]) == (minutiae.kind == 1).sum()
    with pytest.raises(IndexError):
        minutiae[len(minutiae)]


def test_texts_are_short_and_notebooks_show_results(template, result):
    assert repr(template) == "Template(388 x 374 px, 500 dpi, 28 minutiae, ridges)"
    assert repr(template.minutiae) == "Minutiae(28: 14 endings, 14 bifurcations)"
    assert result._repr_html_().startswith("<b>MATCH</b>")
    assert result._shown.shape[1] == 480
    templates = fpmatch.verify(result.probe, result.reference)
    for one in (result, result.overlay(side_by_side=True), templates):
        assert one._repr_png_().startswith(b"\x89PNG")


def test_what_is_shown_is_short_and_escaped(template, result):
    from fpmatch.lab.evaluation.rates.error_rates import error_rates
    from fpmatch.lab.evaluation.rates.scores import unnamed_set
    from fpmatch.lab.evaluation.report.results import RatesReport, SetRates

    rng = np.random.default_rng(5)
    many = fpmatch.Minutiae(*rng.uniform(0, 2000, (2, 3000)), rng.uniform(0, 6, 3000))
    rates = error_rates([3.0, 2.0], [1.0, 0.5])
    scores = unnamed_set(np.array([3.0, 2.0]), np.array([1.0, 0.5]), name=EVIL)
    failures = tuple((f"{k}_{EVIL}.tif", EVIL) for k in range(500))
    row = SetRates(scores, rates, failures)
    for one in (
        *(template, fpmatch.Template(many, 2000, 2000), many, template.minutiae[0], template.field),
        *(result, dataclasses.replace(result, match=False, reason=EVIL), result.overlay()),
        *(fpmatch.read_image(A), fpmatch.match_points(template.minutiae.xy, many.xy[:20])),
        fpmatch.PointMatch.none(reason=EVIL),
        RatesReport(EVIL, "fvc", (row,), rates, rates),
    ):
        text, drawn = repr(one), one._repr_html_() if hasattr(one, "_repr_html_") else ""
        assert len(text) < MOST_LETTERS, type(one)
        assert "\n" not in text, type(one)
        assert len(drawn) < 100_000, type(one)
        assert "<script" not in drawn, type(one)
        HTMLParser().feed(drawn)


def results_in(found):
    """Yield a result and all that its fields hold."""
    if dataclasses.is_dataclass(found):
        yield found
        for field in dataclasses.fields(found):
            yield from results_in(getattr(found, field.name))
    if isinstance(found, tuple | list):
        for one in found[:3]:
            yield from results_in(one)


@pytest.mark.filterwarnings("error")
def test_every_result_can_be_compared_and_hashed_or_says_in_one_line_that_it_cannot(
    fingers, template, tmp_path, prints
):
    db, folder = tmp_path / "g.db", tmp_path / "few"
    folder.mkdir()
    for name in ("1_1.png", "1_2.png", "2_1.png"):
        shutil.copy(prints / name, folder)

    def results():
        verified = fpmatch.verify(fingers[0], np.rot90(fingers[0]).copy())
        yield from (verified, verified.ridge_map, verified.overlay(), template)
        yield from (fpmatch.assess(fingers[0]), fpmatch.GreyImage(fingers[0]))
        yield fpmatch.match_points(template.minutiae.xy, 2 * template.minutiae.xy)
        yield from (fpmatch.enrol(db, [folder]), fpmatch.identify(db, folder / "1_1.png"))
        yield fpmatch.evaluate([folder], workers=1)

    for first, second in zip(results(), results(), strict=True):
        for one, other in zip(results_in(first), results_in(second), strict=True):
            assert one == one  # noqa: PLR0124  (what is tested)
            assert isinstance(one == other, bool)
            assert not one == "another"  # noqa: SIM201
            with suppress(TypeError):
                assert hash(one) == hash(one)
                continue
            with pytest.raises(TypeError, match=r"^unhashable type: '[A-Za-z]+'$"):
                hash(one)


def test_an_overlay_is_saved_in_the_format_of_its_suffix(tmp_path, template):
    overlay = fpmatch.verify(template, template).overlay()
    svg, png = tmp_path / "new" / "a.svg", tmp_path / "new" / "a.PNG"
    overlay.save(svg)
    overlay.save(png)
    assert svg.read_text("utf-8").startswith("<svg")
    assert np.array_equal(np.asarray(Image.open(png)), overlay.pixels)
    with pytest.raises(OutputError, match=r"an overlay is written as \.png or \.svg"):
        overlay.save(tmp_path / "a.jpg")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a.PNG", "a.svg", "new"]


def test_a_comparison_opens_no_connection(monkeypatch):
    def refuse(*_):
        raise AssertionError("a connection was opened")

    for name in ("connect", "connect_ex", "bind", "sendto"):
        monkeypatch.setattr(socket.socket, name, refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    assert fpmatch.verify(A, B).match
