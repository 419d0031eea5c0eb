"""Mutators of any bytes, and the endless inputs that all mutators make together."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from research.fuzzing.mutators import Mutator

MOST_BYTES = 4 * 2**20  # of an input
STRUCTURED_SHARE = 0.75  # of the inputs of targets that have mutators of their own
EXTREMES = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
WORDS = (
    *(b"0", b"-1", b"99999", b"nan", b"inf", b"1e308", b"5e-324", b"3e38", b"", b"4294967296"),
    *(b"\xff\xfe", b"[" * 50, b"\x1b[31m", b"\n", b"\r", b"\0", b"\xed\xa0\x80", b"%s", b"9" * 400),
)


def damaged(
    rng: random.Random,
    corpus: Sequence[bytes],
    mutators: Sequence[Mutator] = (),
    words: Sequence[bytes] = (),
) -> bytes:
    """Return a file of the corpus, damaged by mutators of its format, by any bytes, or by both."""
    data = rng.choice(corpus)
    if mutators and rng.random() < STRUCTURED_SHARE:
        for _ in range(rng.choice((1, 1, 2, 4))):
            try:
                data = rng.choice(mutators)(rng, data)
            except Exception:  # noqa: BLE001  (not of the mutator's format, or no longer)
                data = any_bytes(rng, data, corpus, words)
        if rng.random() < 0.9:
            return data[:MOST_BYTES]
    return any_bytes(rng, data, corpus, words)


def any_bytes(
    rng: random.Random, file: bytes, corpus: Sequence[bytes], words: Sequence[bytes] = ()
) -> bytes:
    """Return a file with a few places changed, cut out, doubled or exchanged."""
    data = bytearray(file)
    for _ in range(rng.choice((1, 1, 2, 3, 5, 8))):
        at = rng.randrange(len(data) + 1)
        if rng.random() < 0.5:
            at = min(at, rng.randrange(64))  # headers decide most
        length = rng.choice((1, 1, 2, 4, 8, rng.randrange(1, 64)))
        way = rng.randrange(8)
        if way == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif way == 1:
            data[at : at + length] = rng.randbytes(length)
        elif way == 2:
            size = rng.choice((1, 2, 4))
            number = rng.choice(EXTREMES) & ((1 << 8 * size) - 1)
            data[at : at + size] = number.to_bytes(size, rng.choice(("big", "little")))
        elif way == 3:
            del data[at : at + length]
        elif way == 4:
            data[at:at] = data[at : at + length] * rng.choice((1, 2, 20))
        elif way == 5:
            data[at : at + rng.choice((0, length))] = rng.choice((*WORDS, *words))
        elif way == 6:
            other = rng.choice(corpus)
            data[at:] = other[rng.randrange(len(other) + 1) :]
        elif rng.random() < 0.3:
            del data[at:]
    return bytes(data[:MOST_BYTES])


def inputs(
    seed: int,
    corpus: Sequence[bytes],
    mutators: Sequence[Mutator] = (),
    words: Sequence[bytes] = (),
) -> Iterator[tuple[bytes, bool]]:
    """Yield the corpus, then endless damaged files; and whether each is damaged."""
    yield from ((data, False) for data in corpus)
    rng = random.Random(seed)
    while True:
        yield damaged(rng, corpus, mutators, words), True
