"""Random numbers by counter: SplitMix64, streams apart, any part alone."""

import numpy as np

from fpmatch.lab.synthesis.noise import keys_of, uniform

# the first numbers of SplitMix64 with the seed 1234567, as published with other implementations
SPLITMIX = (6457827717110365317, 3203168211198807973, 9817491932198370423)


def test_a_stream_is_splitmix64():
    found = uniform(np.array([1234567], np.uint64), 3)[0]
    assert found.dtype == np.float32
    assert np.array_equal(found, [(n >> 40) / 2**24 for n in SPLITMIX])


def test_numbers_are_even():
    numbers = uniform(keys_of(7, np.arange(100), 1, 3), 1000)
    assert 0 <= numbers.min() <= numbers.max() < 1
    share, _ = np.histogram(numbers, 20, (0, 1))
    assert np.abs(share / 5000 - 1).max() < 0.06
    assert abs(numbers.var() - 1 / 12) < 0.001


def test_streams_differ_in_seed_finger_impression_and_purpose():
    kinds = [(a, b, c, d) for a in range(4) for b in range(4) for c in range(4) for d in range(4)]
    keys = np.concatenate([keys_of(*kind) for kind in kinds])
    assert len(np.unique(keys)) == len(kinds)
    correlation = np.corrcoef(uniform(keys, 500))
    assert np.abs(correlation - np.eye(len(kinds))).max() < 0.25


def test_largest_seed_and_finger():
    keys = keys_of(2**63 - 1, np.array([0, 2**53], np.uint64), 1000, 1)
    assert keys.dtype == np.uint64
    assert keys[0] != keys[1]
