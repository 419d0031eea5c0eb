"""What Python programs type: prints in any form, short texts, data frames, notebooks."""

import dataclasses
import shutil
import socket
import time
from contextlib import suppress
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import fpmatch
from fpmatch import Minutia, MinutiaKind, Template
from fpmatch.errors import FpmatchError, OutputError
from fpmatch.matching.calibration import allowance
from fpmatch.matching.compiled import COMPILED
from fpmatch.prints.pair import FIRST_SHARE

SAMPLES = Path(__file__).parents[1] / "sample_data"
A, B = SAMPLES / "101_1.tif", SAMPLES / "101_3.tif"


@pytest.fixture(scope="module")
def template():
    return fpmatch.extract(A)


@pytest.fixture(scope="module")
def result():
    return fpmatch.verify(A, B)


@pytest.mark.parametrize(
    "form", ["text", "path", "image", "array", "colour", "pil", "template", "file"]
)
def test_a_print_may_be_given_in_any_form(form, template, result, tmp_path):
    image = fpmatch.read_image(A)
    file = tmp_path / "a.json"
    fpmatch.save_template(file, template)
    forms = {
        "text": str(A),
        "path": A,
        "image": image,
        "array": image.pixels,
        "colour": np.repeat(image.pixels[..., None], 3, axis=2),
        "pil": Image.fromarray(image.pixels),
        "template": template,
        "file": file,
    }
    found = fpmatch.verify(forms[form], str(B))
    lowered = allowance(FIRST_SHARE) if form in {"array", "colour", "pil"} else 0.0  # unknown dpi
    assert found.score == pytest.approx(result.score - lowered)
    assert found.match
    assert fpmatch.as_template(forms[form]).minutiae == template.minutiae


def test_a_print_verified_with_itself_is_identical(template, result):
    assert result.identical is None
    pixels = fpmatch.read_image(A).pixels
    itself = fpmatch.verify(A, pixels)
    assert (itself.match, itself.identical) == (True, "pixels")
    assert "the two images have the same pixels" in itself._repr_html_()
    assert fpmatch.verify(A, template).identical == "template"


def test_what_is_no_print_is_refused_in_a_line(tmp_path):
    for wrong in (7, None, [1, 2], np.zeros((3, 3)), tmp_path / "missing.tif"):
        with pytest.raises(fpmatch.FpmatchError) as caught:
            fpmatch.verify(A, wrong)
        assert "\n" not in str(caught.value)


def test_it_decides_as_the_functions_on_templates_do(result):
    from fpmatch.matching.verify import verify

    plain = verify(result.probe, result.reference)
    assert (plain.score, plain.match, plain.transform) == (
        result.score,
        result.match,
        result.transform,
    )
    assert np.array_equal(plain.pairs, result.pairs)


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


def test_texts_are_short(template, result):
    assert repr(template) == "Template(388 x 374 px, 500 dpi, 28 minutiae, ridges)"
    assert repr(template.minutiae) == "Minutiae(28: 14 endings, 14 bifurcations)"
    assert repr(fpmatch.Minutiae.empty()) == "Minutiae(0)"
    assert len(repr(result)) < 300


def test_notebooks_show_results(result):
    assert result._repr_html_().startswith("<b>MATCH</b>")
    assert result._repr_png_().startswith(b"\x89PNG")
    assert result.overlay(side_by_side=True)._repr_png_().startswith(b"\x89PNG")
    templates = fpmatch.verify(result.probe, result.reference)
    assert templates._repr_png_().startswith(b"\x89PNG")


MOST_LETTERS = 300
MOST_SECONDS = 0.05


@pytest.fixture(scope="module")
def shown(template, result, tmp_path_factory):
    """Return what Python programs hold, by its name, with names and texts that try to be HTML."""
    from fpmatch.lab.evaluation.rates.error_rates import error_rates
    from fpmatch.lab.evaluation.rates.scores_set import unnamed_set
    from fpmatch.lab.evaluation.report.results import EvaluationReport, SetResult

    evil = "<script>alert(1)</script>"
    rng = np.random.default_rng(5)
    many = fpmatch.Minutiae(*rng.uniform(0, 2000, (2, 3000)), rng.uniform(0, 6, 3000))
    rates = error_rates([3.0, 2.0], [1.0, 0.5])
    scores = unnamed_set(np.array([3.0, 2.0]), np.array([1.0, 0.5]), name=evil)
    failures = tuple((Path(f"{k}_{evil}.tif"), evil) for k in range(500))
    row = SetResult(scores, rates, None, failures, 1.0, 1.0, template, None, None)
    vars_of = {name: getattr(result, name) for name in result.__dataclass_fields__}
    no_match = type(result)(**vars_of | {"match": False, "reason": evil})
    folder = tmp_path_factory.mktemp("gallery")
    with fpmatch.open_gallery(folder / "prints.db", create=True) as gallery:
        yield {
            "template": template,
            "large template": Template(many, 2000, 2000),
            "minutiae": template.minutiae,
            "many minutiae": many,
            "no minutiae": fpmatch.Minutiae.empty(),
            "minutia": template.minutiae[0],
            "ridge field": template.field,
            "verification": result,
            "no match": no_match,
            "overlay": result.overlay(),
            "image": fpmatch.read_image(A),
            "points": fpmatch.match_points(template.minutiae.xy, template.minutiae.xy),
            "no points": fpmatch.PointMatch.none(reason=evil),
            "gallery": gallery,
            "report": EvaluationReport(evil, "fvc", (row,), rates, rates),
        }


def test_what_is_shown_is_short_quick_and_escaped(shown):
    assert shown["verification"]._shown.shape[1] == 480  # drawn once
    for name, one in shown.items():
        taken_s = []
        for _ in range(5):  # in one of them memory may be collected
            start = time.thread_time()
            text, drawn = repr(one), one._repr_html_() if hasattr(one, "_repr_html_") else ""
            taken_s.append(time.thread_time() - start)
        assert min(taken_s) < MOST_SECONDS * (1 if COMPILED else 5), name
        assert len(text) < MOST_LETTERS, name
        assert "\n" not in text, name
        assert len(drawn) < 100_000, name
        assert "<script" not in drawn, name
        HTMLParser().feed(drawn)


WRONG = {
    "template": lambda path, template, image: fpmatch.save_template(template, path),
    "path": lambda path, template, image: fpmatch.save_template(None, template),
    "image": lambda path, template, image: fpmatch.save_template(path, image),
    "load_template": lambda path, template, image: fpmatch.load_template(template),
    "read_image": lambda path, template, image: fpmatch.read_image(template),
    "extract": lambda path, template, image: fpmatch.extract(template),
    "assess": lambda path, template, image: fpmatch.assess(None),
    "open_gallery": lambda path, template, image: fpmatch.open_gallery(template),
    "identify": lambda path, template, image: fpmatch.identify(template, A),
    "enrol": lambda path, template, image: fpmatch.enrol(None, [A]),
    "draw": lambda path, template, image: fpmatch.draw(
        fpmatch.verify(template, template), image, image
    ),
    "save_overlay": lambda path, template, image: fpmatch.save_overlay(
        image, image, template, path
    ),
    "overlay": lambda path, template, image: (
        fpmatch.verify(template, template).overlay().save(template)
    ),
}


@pytest.mark.parametrize("call", WRONG.values(), ids=WRONG)
def test_arguments_of_another_type_get_one_line(tmp_path, monkeypatch, template, whorl, call):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FpmatchError, match=r", not (Template|NoneType|GreyImage)$") as caught:
        call("a.json", template, fpmatch.GreyImage(whorl))
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


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
    fingers, template, rng, tmp_path, prints
):
    points = rng.uniform(size=(30, 2))
    db, folder = tmp_path / "g.db", tmp_path / "few"
    folder.mkdir()
    for name in ("1_1.png", "1_2.png", "2_1.png"):
        shutil.copy(prints / name, folder)

    def results():
        verified = fpmatch.verify(fingers[0], np.rot90(fingers[0]).copy())
        yield from (verified, verified.scale, verified.ridge_map)
        yield from (
            verified.overlay(),
            fpmatch.verify(template, template),
            Template(template.minutiae, 9, 9),
        )
        yield from (
            fpmatch.assess(fingers[0]),
            fpmatch.GreyImage(fingers[0]),
            fpmatch.match_points(points, 2 * points),
        )
        yield from (fpmatch.enrol(db, [folder]), fpmatch.identify(db, folder / "1_1.png"))
        yield fpmatch.evaluate([folder], workers=1)
        with fpmatch.open_gallery(db) as gallery:
            yield list(gallery.entries())

    seen = set()
    for first, second in zip(results(), results(), strict=True):
        for one, other in zip(results_in(first), results_in(second), strict=True):
            seen.add(type(one).__name__)
            assert one == one  # noqa: PLR0124  (what is tested)
            assert isinstance(one == other, bool)
            assert not one == "another"  # noqa: SIM201
            with suppress(TypeError):
                assert hash(one) == hash(one)
                continue
            with pytest.raises(TypeError, match=r"^unhashable type: '[A-Za-z]+'$"):
                hash(one)
    assert seen > {
        *("VerifiedPrints", "Template", "Minutiae", "RidgeField", "Similarity"),
        *("Overlay", "AssessedPrint", "PrintQuality", "GreyImage", "PointMatch"),
        *("IdentifiedFinger", "EvaluationReport", "SetResult", "Rates"),
    }


def test_an_overlay_is_saved_in_the_format_of_its_suffix(tmp_path, template):
    overlay = fpmatch.verify(template, template).overlay()
    svg, png = tmp_path / "new" / "a.svg", tmp_path / "new" / "a.PNG"
    overlay.save(svg)
    overlay.save(png)
    assert svg.read_text("utf-8").startswith("<svg")
    assert np.array_equal(np.asarray(Image.open(png)), overlay.pixels)
    for name in ("a.jpg", "a"):
        with pytest.raises(OutputError, match=r"an overlay is written as \.png or \.svg"):
            overlay.save(tmp_path / name)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a.PNG", "a.svg", "new"]


def test_a_comparison_opens_no_connection(monkeypatch):
    def refuse(*_):
        raise AssertionError("a connection was opened")

    for name in ("connect", "connect_ex", "bind", "sendto"):
        monkeypatch.setattr(socket.socket, name, refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    assert fpmatch.verify(A, B).match
