"""The matcher and the format that the how-to guides show in one file each."""

import importlib.util

import numpy as np
import pytest
from plugin_packages import ROOT

import fpmatch
from fpmatch.formats.record import ReadingOptions, TemplateRecord, View
from fpmatch.matching.registry import get_matcher

FOLDER = ROOT / "docs" / "how-to" / "one_file"


def test_the_matcher_is_symmetric(monkeypatch, template):
    monkeypatch.syspath_prepend(FOLDER)
    hough = get_matcher("hough:MATCHER")
    other = fpmatch.Template(template.minutiae.take(range(5, 30)), 388, 374, dpi=569)
    none = fpmatch.Template(fpmatch.Minutiae.empty(), 9, 9)
    p, q, none = map(hough.prepare, (template, other, none))
    there, back = hough.compare(p, q), hough.compare(q, p)
    assert there.similarity == back.similarity
    assert len(there.pairs) >= 10
    assert sorted(there.pairs.tolist()) == sorted(back.pairs[:, ::-1].tolist())
    assert np.allclose(there.transform.inverse().matrix, back.transform.matrix)
    assert hough.compare(p, none).reason
    assert hough.compare(none, none).similarity == 0


def test_the_format_reads_what_it_writes_and_refuses_the_rest(template):
    spec = importlib.util.spec_from_file_location("tab_format", FOLDER / "tab_format.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    codec = module.CODEC
    data = codec.encode(TemplateRecord("", (View(template),))).data
    assert codec.recognises(data)
    assert codec.decode(data, ReadingOptions()).single().template.minutiae == template.minutiae
    head = b"#tab\t9\t9\t"
    for broken in (b"", b"#tab\t1\n", head + b"x\n", head + b"500\n1\t2\t3\t4\n", b"\xff"):
        with pytest.raises(fpmatch.FpmatchError):
            codec.decode(broken, ReadingOptions())
