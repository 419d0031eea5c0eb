"""Revocable templates: the same for one key, unlike for two, and of one size for every print."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import MatcherError, OutputError, TemplateError
from fpmatch.gallery.encryption.keys import Key
from fpmatch.matching.prints.prepare import prepare
from fpmatch.templates.minutiae import Minutiae, Template
from fpmatch_revocable.cells import GRIDS, MINUTIAE, PAIRS, pair_cells
from fpmatch_revocable.compare import compare, shared_words, similarity
from fpmatch_revocable.template import WORDS, RevocableTemplate, protect

ONE, OTHER = Key(bytes(range(32))), Key(bytes(32))
SIZE = 600


def print_of(seed, count=40):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(150, 450, (2, count))
    return Template(Minutiae(*xy, rng.uniform(0, 2 * np.pi, count)), SIZE, SIZE, 500.0)


def moved(template, turn, shift, noise=0.0, seed=0):
    """Return a print turned about the middle and shifted, its minutiae moved by some noise."""
    m, rng = template.minutiae, np.random.default_rng(seed)
    x, y = m.x - SIZE / 2, m.y - SIZE / 2
    c, s = np.cos(turn), np.sin(turn)
    jitter = rng.normal(0, noise, (2, len(m)))
    x, y = c * x + s * y + SIZE / 2 + shift[0], -s * x + c * y + SIZE / 2 + shift[1]
    xy = np.clip(np.stack([x, y]) + jitter, 0, SIZE - 1)
    return Template(Minutiae(*xy, (m.angle + turn) % (2 * np.pi)), SIZE, SIZE, 500.0)


def test_the_template_of_a_print_and_a_key_is_the_same_again():
    again = [protect(print_of(3), ONE).words.tobytes() for _ in range(2)]
    assert again[0] == again[1]


@given(seed=st.integers(0, 99), count=st.integers(0, 70))
def test_a_template_has_one_size_and_order_for_every_print(seed, count):
    words = protect(print_of(seed, count), ONE).words
    assert words.shape == (MINUTIAE, WORDS) == (48, 264)
    assert words.dtype == np.uint32
    assert (np.diff(words.astype(np.int64), axis=1) >= 0).all()
    assert (np.diff(words[:, 0].astype(np.int64)) >= 0).all()


@given(seed=st.integers(0, 99), count=st.integers(0, 70))
def test_words_are_spread_evenly_and_hardly_repeated(seed, count):
    words = protect(print_of(seed, count), ONE).words.ravel()
    share = np.bincount(words >> 28, minlength=16) / len(words)
    assert abs(share - 1 / 16).max() < 0.015  # seven standard deviations
    assert len(words) - len(np.unique(words)) <= 1  # 0.02 expected


@given(
    seed=st.integers(0, 99),
    turn=st.floats(-3, 3),
    shift=st.tuples(st.floats(-40, 40), st.floats(-40, 40)),
)
def test_a_print_that_is_turned_and_moved_is_similar_and_another_is_not(seed, turn, shift):
    first = print_of(seed)
    a, b = protect(first, ONE), protect(moved(first, turn, shift, noise=1.0), ONE)
    stranger = protect(print_of(seed + 1000), ONE)
    assert compare(a, b) > 0.5
    assert compare(a, stranger) < 0.25


@given(seeds=st.tuples(st.integers(0, 99), st.integers(0, 99)))
def test_the_similarity_is_symmetric_and_within_0_and_1(seeds):
    a, b = (protect(print_of(seed), ONE) for seed in seeds)
    assert 0 <= compare(a, b) == compare(b, a) <= 1


@given(seed=st.integers(0, 99))
def test_templates_of_two_keys_share_no_more_than_random_words(seed):
    a, b = protect(print_of(seed), ONE), protect(print_of(seed), OTHER)
    assert shared_words(a, b).sum() <= 2  # 0.04 expected
    assert similarity(a, b) == 0
    with pytest.raises(MatcherError, match=f"{ONE.id} and {OTHER.id}") as refused:
        compare(a, b)
    assert refused.value.code == "other key"


def test_a_cell_is_in_a_template_once():
    cells, minutia = pair_cells(prepare(print_of(1)))
    assert len(np.unique(cells)) == len(cells) == len(minutia)
    assert np.bincount(minutia).max() <= PAIRS * GRIDS
    assert cells.min() >= 0
    assert cells.max() < 2**30


def test_cells_count_shared_words_one_by_one():
    words = np.arange(48 * 264, dtype=np.uint32).reshape(48, 264)
    other = words + np.uint32(10**6)
    other[5, :3] = words[7, :3]
    shared = shared_words(RevocableTemplate(words, ONE.id), RevocableTemplate(other, ONE.id))
    assert shared[7, 5] == shared.sum() == 3


def test_a_file_is_read_as_it_was_written(tmp_path):
    made = protect(print_of(0), ONE)
    made.save(tmp_path / "a.rev")
    read = RevocableTemplate.load(tmp_path / "a.rev")
    assert (read.words == made.words).all()
    assert read.key_id == ONE.id


def test_bad_files_are_named(tmp_path):
    path = tmp_path / "a.rev"
    with pytest.raises(TemplateError, match=r"a\.rev: no such file"):
        RevocableTemplate.load(path)
    protect(print_of(0), ONE).save(path)
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    bad = [whole[:length] for length in (0, 10, 500, len(whole) - 1)]
    for at in [*range(0, 300, 7), *rng.integers(0, len(whole), 60)]:
        flipped = bytearray(whole)
        flipped[at] ^= 1 << int(rng.integers(8))
        bad.append(bytes(flipped))
    for data in bad:
        path.write_bytes(data)
        with pytest.raises(TemplateError, match=r"a\.rev: .*damaged"):
            RevocableTemplate.load(path)
    with pytest.raises(OutputError):
        protect(print_of(0), ONE).save("/dev/null/a.rev")


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_prints_of_few_minutiae_match_nothing(count):
    assert compare(protect(print_of(0, count), ONE), protect(print_of(0), ONE)) == 0
