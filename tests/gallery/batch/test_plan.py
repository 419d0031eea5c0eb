"""`fpmatch.gallery.batch.plan`: every pair once, in chunks that can be skipped to."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import ScoringError
from fpmatch.gallery.batch.plan import AllPairs, ListedPairs, PrintNames, find_identical_pairs

PROBES = ["a.tif", "b.tif", "b.png"]
REFERENCES = ["x.tif", "y, z.tif"]
NAMES = PrintNames(PROBES, Path()), PrintNames(REFERENCES, Path())


def pairs_of(chunks):
    return [p for c in chunks for p in zip(c.probe.tolist(), c.reference.tolist(), strict=True)]


@given(
    st.integers(1, 20), st.integers(1, 20), st.integers(1, 9), st.integers(1, 40), st.integers(0, 5)
)
def test_every_pair_once_from_any_chunk_on(probes, references, band, size, start):
    plan = AllPairs(probes, references, band=band, pairs_per_chunk=size)
    chunks = list(plan.chunks())
    assert len(chunks) == plan.number_of_chunks
    assert sorted(pairs_of(chunks)) == [(p, r) for p in range(probes) for r in range(references)]
    assert len(plan) == probes * references
    assert max(map(len, chunks)) < size + band
    assert pairs_of(plan.chunks(start)) == pairs_of(chunks[start:])


def read(path, text, **options):
    path.write_text(text, encoding="utf-8")
    return ListedPairs(path, *NAMES, **options)


@pytest.mark.parametrize(
    "text",
    [
        'a.tif,x.tif\nb.png,"y, z.tif"\n',
        'a,x\n\nb.png,"y, z"\n',
        'genuine,reference,probe\n1,x.tif,a.tif\n0,"y, z.tif",b.png\n',
        '\ufeffprobe , reference\r\na.tif, x.tif\r\n b.png,"y, z.tif",more\r\n',
    ],
    ids=["bare", "without extension", "columns by name", "as spreadsheets write"],
)
def test_lists(tmp_path, text):
    plan = read(tmp_path / "pairs.csv", text)
    assert pairs_of(plan.chunks()) == [(0, 0), (2, 1)]
    assert (len(plan), plan.number_of_chunks) == (2, 1)


def test_long_lists_in_chunks(tmp_path, rng):
    drawn = rng.integers([3, 2], size=(25, 2)).tolist()
    lines = "".join(f'{PROBES[p]},"{REFERENCES[r]}"\n' for p, r in drawn)
    plan = read(tmp_path / "pairs.csv", lines, pairs_per_chunk=10)
    chunks = list(plan.chunks())
    assert [len(c) for c in chunks] == [10, 10, 5]
    assert pairs_of(chunks) == [tuple(pair) for pair in drawn]
    assert pairs_of(plan.chunks(2)) == pairs_of(chunks[2:])
    assert chunks[0].probe.dtype == np.int32


def test_identity_is_that_of_the_pairs(tmp_path):
    lists = ("a,x\n", "probe,reference\na.tif,x.tif\n", "b.tif,x\n")
    one, same, other = (read(tmp_path / "pairs.csv", text).identity for text in lists)
    assert one == same != other
    assert AllPairs(2, 3).identity != AllPairs(3, 2).identity


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "the list holds no pairs"),
        ("probe,reference\n", "the list holds no pairs"),
        ("a,x\nb,x\n", "line 2: there is no probe 'b'"),
        ("probe,reference\na,w\n", "line 2: there is no reference 'w'"),
        ("a,x\na\n", "line 2: expected a probe and a reference"),
        ("a,x\n\x00", "line 2: expected a probe and a reference"),
    ],
)
def test_lists_that_cannot_be(tmp_path, text, reason):
    with pytest.raises(ScoringError, match=reason):
        read(tmp_path / "pairs.csv", text)


def test_files_that_are_no_lists(tmp_path):
    (tmp_path / "pairs.csv").write_bytes(b"\xff\xfe\x00")
    for name, reason in (("pairs.csv", "not a CSV file"), ("gone.csv", "no such file"), ("", "is")):
        with pytest.raises(ScoringError, match=reason):
            ListedPairs(tmp_path / name, *NAMES)


_DIGESTS = st.lists(st.sampled_from([b"", b"a", b"b", b"c"]), min_size=1, max_size=12)


@given(_DIGESTS, _DIGESTS, st.integers(0, 5))
def test_identical_pairs_are_those_of_one_digest(probes, references, most):
    sides = [{k: d for k, d in enumerate(side) if d} for side in (probes, references)]
    plan = AllPairs(len(probes), len(references), band=3, pairs_per_chunk=4)
    expected = [
        (i, j)
        for i, one in enumerate(probes)
        for j, other in enumerate(references)
        if one and one == other
    ]
    assert find_identical_pairs(plan, *sides, most) == (len(expected), expected[:most])


def test_of_listed_pairs_those_of_the_list_are_counted(tmp_path):
    plan = read(tmp_path / "list.csv", 'a.tif,x.tif\nb.png,x.tif\nb.png,"y, z.tif"\n')
    digests = {0: b"a", 1: b"a", 2: b"b"}, {0: b"a", 1: b"b"}
    assert find_identical_pairs(plan, *digests, 5) == (2, [(0, 0), (2, 1)])
