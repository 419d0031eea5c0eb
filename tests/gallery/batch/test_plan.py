"""`fpmatch.gallery.batch.plan`: every pair once, in chunks that can be skipped to, and lists."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import ScoringError
from fpmatch.gallery.batch.plan import (
    AllPairs,
    PrintNames,
    find_identical_pairs,
    iterate_pairs,
    listed_pairs,
)
from fpmatch.gallery.batch.sources import StoredTemplate

PROBES = ["a.tif", "b.tif", "b.png"]
REFERENCES = ["x.tif", "y, z.tif"]
NAMES = PrintNames(Path(), PROBES), PrintNames(Path(), REFERENCES)


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


def write(folder, text):
    path = folder / "list"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    "text",
    [
        "a 1.png,b.png,1\nc.png,a 1.png,0\n",
        "a 1.png\tb.png\t1\r\nc.png\ta 1.png\t0\r\n",
        "\ufeffa 1.png;b.png;genuine\n\nc.png;a 1.png;impostor\n",
        'reference , probe,note,genuine\n"b.png","a 1.png",x,1\na 1.png,c.png,,0',
    ],
)
def test_rows_in_every_form(tmp_path, text):
    rows = [("a 1.png", "b.png", True), ("c.png", "a 1.png", False)]
    assert [row[1:] for row in iterate_pairs(write(tmp_path, text))] == rows


def test_spaces_separate_where_nothing_else_does(tmp_path):
    rows = list(iterate_pairs(write(tmp_path, "\n  a   b  1\nc d 0\n")))
    assert rows == [(2, "a", "b", True), (3, "c", "d", False)]
    assert list(iterate_pairs(write(tmp_path, "probe reference\na b\n"))) == [(2, "a", "b", None)]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "the list holds no pairs"),
        ("probe,reference\n", "the list holds no pairs"),
        ("a,x\nb,x\n", "line 2: there is no probe 'b'"),
        ("probe,reference\na,w\n", "line 2: there is no reference 'w'"),
        ("a,x\na\n", "line 2: expected a probe and a reference"),
        ("a,x\n\x00", "line 2: expected a probe and a reference"),
        ("a x 1\na x 2\n", "line 2, column genuine: must be 1 or 0, not '2'"),
        (b"a,x\n\xffc,d\n", "not a CSV file in UTF-8"),
        (None, "cannot be read: no such file"),
    ],
)
def test_lists_that_cannot_be(tmp_path, text, reason):
    path = tmp_path / "gone" if text is None else write(tmp_path, text)
    with pytest.raises(ScoringError) as caught:
        listed_pairs(path, *NAMES)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_long_lists_in_chunks(tmp_path, rng):
    drawn = rng.integers([3, 2], size=(25, 2)).tolist()
    lines = "".join(f'{PROBES[p]},"{REFERENCES[r]}"\n' for p, r in drawn)
    plan = listed_pairs(write(tmp_path, lines), *NAMES, pairs_per_chunk=10)
    chunks = list(plan.chunks())
    assert (len(plan), [len(c) for c in chunks]) == (25, [10, 10, 5])
    assert pairs_of(chunks) == [tuple(pair) for pair in drawn]
    assert pairs_of(plan.chunks(2)) == pairs_of(chunks[2:])


def test_identity_is_that_of_the_pairs(tmp_path):
    lists = ("a,x\n", "probe,reference\na.tif,x.tif\n", "b.tif,x\n", "a,x,1\n")
    one, same, *others = (listed_pairs(write(tmp_path, text), *NAMES).identity for text in lists)
    assert one == same
    assert len({one, *others}) == 3
    assert AllPairs(2, 3).identity != AllPairs(3, 2).identity


def test_prints_are_found_by_any_path_that_ends_so(tmp_path):
    names = PrintNames(tmp_path, ["db/ada/1.png", "db/bob/1.png", "db/bob/2.png"])
    paths = [
        "bob/1.png",
        "db/bob/1",
        str(tmp_path / "db" / "ada" / "1.png"),
        "./2.png",
        "2",
        "ada\\1",
    ]
    found = [names.find(name) for name in paths]
    assert found == [1, 1, 0, 2, 2, 0]
    missing = ["1.png", "1", "eve/1.png", "other/bob/1.png", "", ".", "/", "ng"]
    assert [names.find(name) for name in missing] == [None] * 8


def stored(digests):
    return {k: StoredTemplate(None, digest=one) for k, one in enumerate(digests)}


_DIGESTS = st.lists(st.sampled_from([b"", b"a", b"b", b"c"]), min_size=1, max_size=12)


@given(_DIGESTS, _DIGESTS, st.integers(0, 5))
def test_identical_pairs_are_those_of_one_digest(probes, references, most):
    sides = [stored(side) for side in (probes, references)]
    plan = AllPairs(len(probes), len(references), band=3, pairs_per_chunk=4)
    expected = [
        (i, j)
        for i, one in enumerate(probes)
        for j, other in enumerate(references)
        if one and one == other
    ]
    found, first = find_identical_pairs(plan, *sides, most)
    assert (found, len(first)) == (len(expected), min(most, len(expected)))
    assert {*first} <= {*expected}
