"""Files that other software wrote: counts, resolutions, conventions. Skipped where they are not."""

import pytest

from fpmatch.formats.files import load_record
from tests.formats.made_records import FORMATS

pytestmark = pytest.mark.skipif(not FORMATS.is_dir(), reason="no files of other software here")

# Format, and for each view how many minutiae.
EXPECTED = {
    "an2/libbiomeval_type9.an2k": ("an2", [28]),
    "an2/nistref_type-9-13-m1.an2": ("an2", [48]),
    "an2/nistref_type-9-4-iafis.an2": ("an2", [48]),
    "ansi378/fingerprintio_ansi378v2004_ansi378v2004-sample.dat": ("ansi2004", [27, 22]),
    "ansi378/fingerprintio_ansi378v2009_ansi378v2009-sample.dat": ("ansi2009", [27, 22]),
    "ansi378/fingerprintio_ansi378v2009am1_ansi378v2009am1-sample.dat": ("ansi2009", [27, 22]),
    "ansi378/libbiomeval_fmr.ansi2004": ("ansi2004", [27, 22, 28]),
    "iso19794-2/fingerjet_a001_03p.ist": ("iso2005", [68]),
    "iso19794-2/fingerprintio_iso19794p2v2005_iso19794p2v2005-sample.dat": ("iso2005", [27, 22]),
    "iso19794-2/fingerprintio_iso19794p2v2011_iso19794p2v2011-sample.dat": ("iso2011", [27, 22]),
    "iso19794-2/libbiomeval_fmr.iso2005": ("iso2005", [27, 22]),
    "iso19794-2/sourceafis_iso-matching.dat": ("iso2005", [38]),
    "xyt/fvc2000db1b_101_1.xyt": ("xyt-m1", [20]),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_counts_and_resolution(name):
    record = load_record(FORMATS / name)
    expected, counts = EXPECTED[name]
    assert record.format == expected
    assert [len(view.template.minutiae) for view in record.views] == counts
    for view in record.views:
        assert view.template.dpi == 500
        assert view.template.dpi_known is (expected != "xyt-m1")
        minutiae = view.template.minutiae
        assert 0 <= minutiae.x.min() <= minutiae.x.max() < view.template.width
        assert 0 <= minutiae.y.min() <= minutiae.y.max() <= view.template.height
