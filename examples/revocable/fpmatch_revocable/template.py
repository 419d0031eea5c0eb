"""A revocable template: a fixed number of words, which look random without the key.

The words of a minutia are its cells (see `fpmatch_revocable.cells`), each encrypted as a block of
AES-256 and cut to 32 bits. A cell occurs once in a template, rows without enough cells are filled
with encrypted numbers that no other print has, and rows and words are sorted: without the key, what
is stored is indistinguishable from random numbers, of which there are as many for every print.
Under another key the words are others.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.gallery.store.array_file import Column, read_arrays, write_arrays
from fpmatch.matching.prints.prepare import prepare
from fpmatch_revocable.cells import GRIDS, MINUTIAE, PAIRS, pair_cells

if TYPE_CHECKING:
    import os
    from typing import Self

    from numpy.typing import NDArray

    from fpmatch.gallery.encryption.keys import Key
    from fpmatch.templates.minutiae import Template

WORDS: Final = PAIRS * GRIDS  # of a minutia
_ID_BYTES: Final = 8
_ABOUT: Final = {"content": "fpmatch revocable template", "version": "1"}
_COLUMNS: Final = {
    "words": Column("<u4", (MINUTIAE, WORDS)),
    "key_id": Column("|u1", (_ID_BYTES,)),
}


@dataclass(frozen=True, eq=False)
class RevocableTemplate:
    """A print under a key: `protect` makes it, `compare` compares two of the same key.

    Parameters
    ----------
    words : ndarray of uint32, shape (48, 264)
        A row for each minutia; the other rows have words of no minutia.
    key_id : str
        Id of the key; it does not contain the key.
    """

    words: NDArray[np.uint32]
    key_id: str

    @cached_property
    def index(self) -> tuple[NDArray[np.uint32], NDArray[np.int64]]:
        """All words in ascending order, and the row of each."""
        flat = self.words.ravel()
        order = np.argsort(flat, kind="stable")
        return flat[order], order // self.words.shape[1]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file, which appears whole or not at all, else raise OutputError."""
        key_id = np.frombuffer(bytes.fromhex(self.key_id), np.uint8)
        write_arrays(path, {"words": self.words, "key_id": key_id}, _COLUMNS, _ABOUT)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a file that `save` wrote; TemplateError if it cannot be read or is damaged."""
        try:
            arrays = read_arrays(path, _COLUMNS, _ABOUT)
        except FpmatchError as error:
            why = "not a revocable template, or damaged"
            if error.code in {"missing", "unreadable"}:
                why = error.detail
            raise TemplateError(why, path=path, code=error.code) from error
        return cls(np.array(arrays["words"]), arrays["key_id"].tobytes().hex())


def protect(template: Template, key: Key) -> RevocableTemplate:
    """Return a template under a key; the same one whenever template and key are the same.

    Parameters
    ----------
    template : Template
        Of a print; its ridges have no part.
    key : Key
        Secret of the system, or of the person, as `fpmatch.gallery.encryption.keys.load_keys` reads
        it.

    Raises
    ------
    EncryptionError
        If the package ``cryptography`` (extra ``fpmatch[encryption]``) is not installed.

    Examples
    --------
    >>> import fpmatch
    >>> from fpmatch.gallery.encryption.keys import new_key
    >>> from fpmatch.templates.minutiae import Minutiae, Template
    >>> one = Template(Minutiae([50, 90, 70], [50, 60, 95], [0.1, 1.4, 2.2]), 200, 200, 500)
    >>> protect(one, new_key()).words.shape
    (48, 264)
    """
    cells, minutia = pair_cells(prepare(template))
    words = words_of(np.arange(MINUTIAE * WORDS), key, _digest(cells)).reshape(MINUTIAE, WORDS)
    own = words_of(cells, key)
    for row in range(MINUTIAE):
        of_minutia = own[minutia == row]
        words[row, : len(of_minutia)] = of_minutia
    words.sort(axis=1)
    return RevocableTemplate(words[np.argsort(words[:, 0], kind="stable")], key.id)


def _digest(cells: NDArray[np.int64]) -> int:
    """Return a number that two prints do not share, and that is not 0."""
    return int.from_bytes(hashlib.sha256(cells.tobytes()).digest()[:8], "little") | 1


def words_of(numbers: NDArray[np.int64], key: Key, series: int = 0) -> NDArray[np.uint32]:
    """Return the words of different numbers of one series under a key; 0 is that of cells.

    AES of blocks that are all different is a pseudo-random function of each block by itself.
    """
    from cryptography.hazmat.primitives.ciphers import Cipher, algorithms, modes  # noqa: PLC0415

    secret = key.derive(b"revocable template", b"")
    blocks = np.empty((len(numbers), 2), "<u8")
    blocks[:, 0], blocks[:, 1] = numbers, series
    cipher = Cipher(algorithms.AES(secret), modes.ECB()).encryptor()
    sealed = cipher.update(blocks.tobytes()) + cipher.finalize()
    return np.frombuffer(sealed, "<u4").reshape(-1, 4)[:, 0].astype(np.uint32)
