"""Whatever the bytes, a template reader answers with a template or an error of ours."""

from __future__ import annotations

import warnings

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_records import sample_files

from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.formats.codec import Codec
from fpmatch.formats.record import ReadingOptions, ReadLimits, TemplateRecord
from fpmatch.formats.registry import CODECS, codec_of_content, codec_of_name

FILES = sample_files()
STARTS = [b"", *(data[:40] for data in FILES.values()), *(data[:8] for data in FILES.values())]


def read(data: bytes, codec: Codec | None = None) -> TemplateRecord | None:
    """Return what a codec (by default the one that takes them) reads in some bytes.

    None where it refuses them, in one line.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return (codec or codec_of_content(data)).decode(data, ReadingOptions())
        except FpmatchError as error:
            words = str(error)
    assert words
    assert "\n" not in words
    return None


@given(st.binary(max_size=300), st.sampled_from(STARTS))
@settings(max_examples=300)
def test_any_bytes_are_read_or_refused(data: bytes, start: bytes) -> None:
    read(start + data)


@pytest.mark.parametrize("codec", CODECS, ids=lambda codec: codec.name)
@given(st.binary(max_size=200))
def test_a_codec_that_is_named_refuses_what_is_not_its_own(codec: Codec, data: bytes) -> None:
    read(data, codec)


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """Return a good file with some bytes changed, cut out or put in."""
    data = bytearray(draw(st.sampled_from(list(FILES.values()))))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(data)))
        cut = draw(st.integers(0, 8))
        data[at : at + cut] = draw(st.binary(max_size=8))
    return bytes(data[: draw(st.integers(0, len(data)))]) if draw(st.booleans()) else bytes(data)


@given(damaged())
@settings(max_examples=250)
def test_a_damaged_file_is_read_or_refused(data: bytes) -> None:
    read(data)


@pytest.mark.parametrize("name", FILES)
def test_no_beginning_of_a_file_passes_for_more_than_it_is(name: str) -> None:
    whole = read(FILES[name])
    assert whole is not None
    most = len(whole.views[0].template.minutiae)
    for end in range(0, len(FILES[name]), max(1, len(FILES[name]) // 60)):
        part = read(FILES[name][:end])
        if part is not None:
            assert part.format in {name, "xyt", "xyt-m1", "csv"}
            assert len(part.views[0].template.minutiae) <= most


@pytest.mark.parametrize("name", FILES)
def test_limits_hold_for_every_format(name: str) -> None:
    codec = codec_of_name(name)
    few = ReadingOptions(limits=ReadLimits(max_minutiae=2))
    with pytest.raises(TemplateError, match="more than 2 minutiae"):
        codec.decode(FILES[name], few)
    small = ReadingOptions(limits=ReadLimits(max_side_px=100))
    with pytest.raises(TemplateError, match="more than 100 pixels"):
        codec.decode(FILES[name], small)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"FMR\x00 99\x00" + bytes(40), "of version '99', which is not known"),
        (b"FMR\x00 20\x00\x00\x00\x00\x18" + bytes(11), "cut short"),
        (b"FMR\x00 20\x00\x00\x00\x00\x18" + bytes(12), "holds no print"),
        (b"1.001:99\x1d1.003:1\x1f1\x1e9\x1f01\x1c", "cut short"),
        (b"1.001:26\x1d1.003:1\x1f1\x1e9\x1f01\x1c99", "no record of type 9"),
        (b"Image (w,h) 9 9\n\n2 Minutiae Detected\n\n", "declares 2 minutiae and has 0"),
        (b"Image (w,h) 9 9\n\n1 Minutiae Detected\n\nx\n", "line 5: not a minutia"),
        (b"1 2 3 4\n1 2\n", "line 2: expected x, y, angle"),
        (b"1 2 3 4\n1 2 3\n", "some lines have a quality"),
        (b"1 2 999 4\n", "line 1: an angle of 999"),
    ],
    ids=repr,
)
def test_what_is_wrong_is_said(data: bytes, reason: str) -> None:
    with pytest.raises(TemplateError, match=reason):
        codec_of_content(data).decode(data, ReadingOptions())
