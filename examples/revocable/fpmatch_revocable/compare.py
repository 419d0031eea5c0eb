"""Comparison of two revocable templates of the same key, without the key."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import MatcherError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch_revocable.template import RevocableTemplate

BY_CHANCE: Final = 2  # words that two minutiae may share without being paired
ADDED: Final = 40  # shared words that are added to those of two prints, so that few weigh little


def compare(a: RevocableTemplate, b: RevocableTemplate) -> float:
    """Return the similarity of two templates of one key, 0 to 1, the same in either order.

    Two minutiae are paired if each shares more words with the other than with any third one; the
    similarity is the share of all shared words that pairs have beyond chance.

    Parameters
    ----------
    a, b : RevocableTemplate

    Raises
    ------
    MatcherError
        If they were made with different keys (code "other key").

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch_revocable.template import RevocableTemplate
    >>> words = np.arange(48 * 264, dtype=np.uint32).reshape(48, 264)
    >>> one = RevocableTemplate(words, "00" * 8)
    >>> round(compare(one, one), 3)
    0.989
    """
    if a.key_id != b.key_id:
        why = f"templates of different keys, {a.key_id} and {b.key_id}, cannot be compared"
        raise MatcherError(why, code="other key")
    return similarity(a, b)


def similarity(a: RevocableTemplate, b: RevocableTemplate) -> float:
    """Return the similarity as `compare` does, whatever the keys."""
    shared = shared_words(a, b)
    mutual = (shared == shared.max(1, keepdims=True)) & (shared == shared.max(0, keepdims=True))
    beyond_chance = int(np.maximum(shared[mutual] - BY_CHANCE, 0).sum())
    return beyond_chance / (int(shared.sum()) + ADDED)


def shared_words(a: RevocableTemplate, b: RevocableTemplate) -> NDArray[np.int64]:
    """Return how many words each minutia of A shares with each of B."""
    (words_a, row_a), (words_b, row_b) = a.index, b.index
    place = np.searchsorted(words_b, words_a)
    place[place == len(words_b)] = 0
    same = words_b[place] == words_a
    size = len(a.words), len(b.words)
    cell = row_a[same] * size[1] + row_b[place[same]]
    return np.bincount(cell, minlength=size[0] * size[1]).reshape(size)
