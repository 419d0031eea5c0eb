"""After a removal nothing of the entry can be read in any file of the gallery."""

from pathlib import Path

import numpy as np
import pytest
from made_prints import entry_of, refused

from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index.segment import Segment
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search.search import Search
from fpmatch.gallery.store.stored_template import unpack_template
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

RUN = 32  # bytes that count as a trace


def random_entry(number, count=60):
    """Return an entry no part of whose template is in another one."""
    rng = np.random.default_rng(number)
    x, y = rng.uniform(0, 300, (2, count))
    kind, quality = rng.integers(0, 3, count), rng.integers(0, 101, count)
    minutiae = Minutiae(x, y, rng.uniform(0, 6, count), kind, quality)
    mask = rng.random((12, 12)) < 0.7
    ridges = rng.integers(0, 2**63, mask.shape).astype(np.uint64)
    field = RidgeField(25.0, rng.uniform(0, 3, mask.shape), mask, ridges)
    label = Label(f"subject {number} {rng.bytes(20).hex()}")
    source = f"/prints/{rng.bytes(20).hex()}.tif"
    with_field = field if number % 3 else None
    template = Template(minutiae, 300, 300, 500.0, with_field)
    return entry_of(number, template, label, source=source, content=rng.bytes(32))


def secrets_of(entry):
    """Return all that must not be left of an entry."""
    names = (entry.label.subject.encode(), entry.source.encode(), entry.content)
    return [entry.template, *in_a_segment(entry), *names]


def in_a_segment(entry):
    """Return what the index has of an entry, but what any print may have."""
    prepared = MATCHER.prepare(unpack_template(entry.template))
    arrays = Segment.build([1], [2**40], [prepared]).arrays()
    return [array.tobytes() for name, array in arrays.items() if name != "term_start"]


def runs_of(parts):
    """Return every run of 32 bytes, but those of few values, which any print may have."""
    runs = (part[k : k + RUN] for part in parts for k in range(len(part) - RUN + 1))
    return {run for run in runs if len(set(run)) > 12}


def traces(folder, runs):
    """Return the files below a folder in which any of some runs is."""
    files = [(path, path.read_bytes()) for path in folder.rglob("*") if path.is_file()]
    return [
        path.name
        for path, data in files
        if any(data[k : k + RUN] in runs for k in range(len(data) - RUN + 1))
    ]


def unfinished(folder, entry):
    """Leave a file as a killed preparation does, and one of an earlier version."""
    names = ("unit-circle-0.2.0-abc.arrays", "unit-circle.0123456789abcdef.segment")
    for name in (f".{16 * 'a'}.part", *names):
        (folder / name).write_bytes(b"".join(secrets_of(entry)))


@pytest.mark.parametrize("in_cache", [False, True])
@pytest.mark.parametrize("of_a_segment", [4, 1000])
def test_no_run_of_a_removed_template_is_left_in_any_file(
    tmp_path, cache, monkeypatch, *, in_cache, of_a_segment
):
    """Of an index in one segment or two, in either folder, and of files that others left."""
    monkeypatch.setattr("fpmatch.gallery.search.search.EXHAUSTIVE_UP_TO", 2)
    monkeypatch.setattr("fpmatch.gallery.index.follow.MOST_PRINTS", of_a_segment)
    entries = [random_entry(k, 40 + 30 * (k % 4)) for k in range(6)]
    all_runs = [runs_of([*secrets_of(one), *in_a_segment(one)]) for one in entries]
    if in_cache:
        (tmp_path / "g.db.prepared").touch()  # in the way
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        gallery.add(entries)
        Search(gallery, engine=serial(), note=str)
        numbers = {entry.label: entry.id for entry in gallery.entries()}
        for gone in (3, 0, 5):
            entry = entries[gone]
            runs = all_runs[gone].difference(*all_runs[:gone], *all_runs[gone + 1 :])
            assert len(runs) > 500
            assert len(traces(tmp_path, runs)) == 2  # the database and a segment
            for folder in (tmp_path / "g.db.prepared", *cache.glob("fpmatch/galleries/*")):
                if folder.is_dir():
                    unfinished(folder, entry)
            gallery.remove([numbers[entry.label]])
            assert traces(tmp_path, runs) == []
            Search(gallery, engine=serial(), note=str)
            assert traces(tmp_path, runs) == []
        assert len(Search(gallery, note=str)) == 3


def test_compact_makes_the_file_smaller_and_deletes_what_is_outdated(tmp_path, run, monkeypatch):
    monkeypatch.setattr("fpmatch.gallery.search.search.EXHAUSTIVE_UP_TO", 2)
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        gallery.add([random_entry(k) for k in range(60)])
        Search(gallery, engine=serial())
        gallery.remove(range(1, 56))
        Search(gallery, engine=serial())
        unfinished(tmp_path / "g.db.prepared", random_entry(1))
        entries = list(gallery.entries())
    before = (tmp_path / "g.db").stat().st_size
    assert run("gallery", "rewrite", tmp_path / "g.db").exit_code == 0
    assert (tmp_path / "g.db").stat().st_size < before * 0.6
    assert len(list((tmp_path / "g.db.prepared").iterdir())) == 1
    with open_gallery(tmp_path / "g.db") as gallery:
        assert list(gallery.entries()) == entries
        assert len(Search(gallery)) == 5

        def locked(path, **_):
            raise PermissionError(13, "in use", str(path))

        monkeypatch.setattr(Path, "unlink", locked)
        error = refused(gallery.remove, [56], code="traces")
        assert "removed, but traces may be left" in str(error)
        assert len(gallery) == 4
