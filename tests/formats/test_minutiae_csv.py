"""Plain CSV of minutiae: what other programs write is read, and what is wrong is named."""

from __future__ import annotations

import numpy as np
import pytest
from made_records import FORMATS, sample_record, written

from fpmatch.errors import TemplateError
from fpmatch.formats.minutiae_csv import CODEC
from fpmatch.formats.record import ReadingOptions
from fpmatch.formats.registry import codec_of_content
from fpmatch.minutiae import STANDARD_DPI, MinutiaKind

LEADER = FORMATS.parent / "minutiae" / "leader" / "fvc2004" / "DB1_B" / "101_1.csv"


def test_the_file_is_a_table_with_one_header() -> None:
    record = sample_record(3)
    lines = written(CODEC, record).decode().splitlines()
    assert lines[0] == "x,y,theta,type,quality"
    minutiae = record.views[0].template.minutiae
    cells = [line.split(",") for line in lines[1:]]
    assert [float(row[0]) for row in cells] == minutiae.x.tolist()
    theta = [float(row[2]) for row in cells]
    assert theta == pytest.approx(np.degrees(minutiae.angle.astype(float)).tolist(), abs=1e-6)
    assert [row[3] for row in cells] == ["UEB"[kind] for kind in minutiae.kind.tolist()]


def test_columns_have_any_order_and_others_are_read_past() -> None:
    data = b"Theta,score,y,X,type\r\n90,0.5,20,10,b\r\n\r\n-90,0.1,3,4,E\r\n"
    assert codec_of_content(data) is CODEC
    view = CODEC.decode(data, ReadingOptions()).views[0]
    minutiae = view.template.minutiae
    assert minutiae.xy.tolist() == [[10, 20], [4, 3]]
    assert np.degrees(minutiae.angle) == pytest.approx([90, 270])
    assert minutiae.kind.tolist() == [MinutiaKind.BIFURCATION, MinutiaKind.ENDING]
    assert (view.template.width, view.template.height) == (11, 21)
    assert view.template.dpi == STANDARD_DPI
    assert not any([view.size_known, view.dpi_known, view.quality_known])


def test_without_types_kinds_are_other() -> None:
    minutiae = CODEC.decode(b"x,y,theta\n1,2,3\n", ReadingOptions()).views[0].template.minutiae
    assert minutiae.kind.tolist() == [MinutiaKind.OTHER]


def test_a_file_of_the_header_alone_has_no_minutiae() -> None:
    record = CODEC.decode(b"x,y,theta,type,quality\n", ReadingOptions(size=(300, 400)))
    assert len(record.views[0].template.minutiae) == 0


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"x,y,angle\n1,2,3\n", "line 1: expected the columns"),
        (b"x,y,theta,x\n1,2,3,4\n", "each once"),
        (b"x,y,theta\n1,2\n", "line 2: expected 3 values, found 2"),
        (b"x,y,theta\n1,2,east\n", "line 2: could not convert"),
        (b"x,y,theta\n1,nan,3\n", "line 2: a value is not finite"),
        (b"x,y,theta,quality\n1,2,3,101\n", "quality not in 0..100"),
        (b"x,y,theta,type\n1,2,3,loop\n", "line 2: a type 'loop'"),
        (b"x,y,theta\n\xff,2,3\n", "not UTF-8 text"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(data: bytes, said: str) -> None:
    with pytest.raises(TemplateError, match=said):
        CODEC.decode(data, ReadingOptions())


@pytest.mark.skipif(not LEADER.exists(), reason="the shared minutiae are not beside the project")
def test_minutiae_of_another_extractor_are_read() -> None:
    template = CODEC.decode(LEADER.read_bytes(), ReadingOptions(size=(640, 480))).views[0].template
    assert len(template.minutiae) == LEADER.read_text().count("\n") - 1
    assert set(template.minutiae.kind.tolist()) <= {kind.value for kind in MinutiaKind}
