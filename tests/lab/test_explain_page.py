import re
from pathlib import Path

import pytest

from fpmatch.errors import OutputError
from fpmatch.lab.explain.page import write_folder

OWN = re.compile(r"page_\d\.html")


def test_a_folder_replaces_one_of_its_own_and_no_other(tmp_path):
    out = tmp_path / "new" / "out"
    for pages in ({"page_1.html": b"1", "page_2.html": b"2"}, {"page_3.html": b"3"}):
        write_folder(pages, out, replaced=OWN)
        assert {path.name: path.read_bytes() for path in out.iterdir()} == pages
    (out / "mine.txt").touch()
    with pytest.raises(OutputError, match=r"out: holds another file, mine\.txt"):
        write_folder({"page_1.html": b""}, out, replaced=OWN)
    assert sorted(path.name for path in out.iterdir()) == ["mine.txt", "page_3.html"]
    with pytest.raises(OutputError, match="cannot be"):
        write_folder({"page_1.html": b""}, out / "mine.txt" / "out", replaced=OWN)
    assert list(out.parent.iterdir()) == [out]


@pytest.mark.parametrize("fails", ["make_missing", "Path.rename"])
def test_a_folder_that_cannot_be_written_whole_is_as_before(tmp_path, monkeypatch, fails):
    write_folder({"page_1.html": b"1"}, tmp_path / "out", replaced=OWN)
    rename, calls = Path.rename, []

    def fail(*args, **_):
        calls.append(args)
        if fails == "Path.rename" and len(calls) != 2:  # the new folder is the second to be moved
            return rename(*args)
        raise KeyboardInterrupt

    monkeypatch.setattr(f"fpmatch.lab.explain.page.{fails}", fail)
    with pytest.raises(KeyboardInterrupt):
        write_folder({"page_2.html": b"2"}, tmp_path / "out", replaced=OWN)
    assert [path.name for path in tmp_path.rglob("*")] == ["out", "page_1.html"]
