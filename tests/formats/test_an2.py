"""ANSI/NIST-ITL files: each block of minutiae by its own convention, and where frames stand."""

from __future__ import annotations

import numpy as np
import pytest
from made_records import an2_file

from fpmatch.errors import TemplateError
from fpmatch.formats.an2 import CODEC, decode
from fpmatch.formats.record import ReadingOptions
from fpmatch.formats.registry import codec_of_content

PX = 500 / 2540  # pixels in 0.01 mm at 500 dpi


@pytest.mark.parametrize(
    ("block", "x", "y", "degrees", "kinds"),
    [
        (
            "standard",
            [1000 * PX, 2000 * PX, 0],
            [400 - 500 * PX, 400 - 1000 * PX, 400],
            [270, 90, 180],
            [1, 2, 0],
        ),
        ("iafis", [1000 * PX, 2000 * PX, 0], [500 * PX, 1000 * PX, 0], [270, 90, 180], [1, 2, 0]),
        ("m1", [100, 200, 0], [50, 100, 0], [270, 90, 180], [1, 2, 0]),
        (
            "efs",
            [1100 * PX, 2100 * PX, 100 * PX],
            [700 * PX, 1200 * PX, 200 * PX],
            [270, 90, 180],
            [1, 2, 0],
        ),
    ],
)
def test_each_block_by_its_own_convention(
    block: str, x: list[float], y: list[float], degrees: list[float], kinds: list[int]
) -> None:
    record = codec_of_content(an2_file(block)).decode(an2_file(block), ReadingOptions())
    assert record.format == "an2"
    (view,) = record.views
    minutiae = view.template.minutiae
    assert np.allclose(minutiae.x, x, atol=0.01)
    assert np.allclose(minutiae.y, y, atol=0.01)
    assert np.allclose(np.degrees(minutiae.angle), degrees, atol=0.01)
    assert minutiae.kind.tolist() == kinds
    assert view.finger == 7
    assert view.impression == 1
    assert (view.template.width, view.template.height, view.template.dpi) == (300, 400, 500)


def test_qualities_run_from_2_the_best_to_63_and_0_and_1_tell_none() -> None:
    view = decode(an2_file("standard"), ReadingOptions()).views[0]
    assert view.quality_known
    assert view.template.minutiae.quality.tolist() == [100, 100, 0]
    assert decode(an2_file("m1"), ReadingOptions()).views[0].template.minutiae.quality.tolist() == [
        90,
        80,
        100,
    ]
    assert not decode(an2_file("efs"), ReadingOptions()).views[0].quality_known


@pytest.mark.parametrize("image", ["13", "4"])
def test_the_image_record_gives_the_size(image: str) -> None:
    view = decode(an2_file("iafis", image), ReadingOptions()).views[0]
    assert (view.template.width, view.template.height) == (300, 400)
    assert view.size_known
    assert view.dpi_known


def test_without_an_image_record_the_size_is_what_the_minutiae_span() -> None:
    view = decode(an2_file("standard", "none"), ReadingOptions()).views[0]
    assert view.dpi_known
    assert not view.size_known
    assert (view.template.width, view.template.height) == (394, 197 + 1)
    told = decode(an2_file("standard", "none"), ReadingOptions(size=(500, 600))).views[0]
    assert (told.template.width, told.template.height) == (500, 600)
    assert told.template.minutiae.y.max() == 600


def test_without_any_resolution_the_readers_holds() -> None:
    data = an2_file("standard", "none", "00.00")
    assert not decode(data, ReadingOptions()).views[0].dpi_known
    view = decode(data, ReadingOptions(dpi=1000)).views[0]
    assert view.template.dpi == 1000
    assert view.template.minutiae.x.max() == pytest.approx(2000 * 1000 / 2540, abs=0.01)


def test_a_record_without_minutiae_is_no_print() -> None:
    with pytest.raises(TemplateError, match="no minutiae in the file"):
        decode(an2_file("none"), ReadingOptions())


def test_a_file_of_images_only_is_no_template() -> None:
    data = an2_file().replace(b"\x1e9\x1f01", b"")
    assert not CODEC.recognises(data)


def test_a_field_that_is_malformed_is_named() -> None:
    data = an2_file("standard").replace(b"10000500090", b"1000x500090")
    with pytest.raises(TemplateError, match=r"field 9\.012 is malformed"):
        decode(data, ReadingOptions())


@pytest.mark.parametrize("separator", [b"\x1e", b"\x1f", b"\x1d"])
def test_a_field_of_nothing_but_separators_is_refused_at_once(separator: bytes) -> None:
    many = separator * 200_000
    for data in (
        an2_file("standard").replace(b"9.012:", b"9.012:" + many),
        an2_file("standard").replace(b"1.003:", b"1.003:" + many),
    ):
        length = len(data) - len(an2_file("standard"))
        for kind in (b"1.001:", b"9.001:"):
            start = data.index(kind) + len(kind)
            end = data.index(b"\x1d", start)
            told = b"%d" % (int(data[start:end]) + length)
            with pytest.raises(TemplateError):
                decode(data[:start] + told + data[end:], ReadingOptions())
