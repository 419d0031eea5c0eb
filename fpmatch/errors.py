"""The family of errors that fpmatch raises for bad input.

Every message is one line that names the thing at fault and the reason, ready to be shown to a
person. Programming errors (a wrong type, say) stay the built-in exceptions they are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fpmatch.printable import message_text, printable

if TYPE_CHECKING:
    from collections.abc import Iterable


def unknown_name(what: str, name: str, known: Iterable[str]) -> str:
    """Return the message about a name that is none of the known ones, with the closest of these."""
    names = list(known)
    question = did_you_mean(name, names)
    return f"unknown {what} {name!r}; known: {', '.join(names)}{'.' * bool(question)}{question}"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a space and the question whether the closest known name is meant, if one is close."""
    from difflib import get_close_matches  # noqa: PLC0415  (only after an error)

    closest = get_close_matches(str(name), list(known), n=1)
    return f" Did you mean {closest[0]!r}?" if closest else ""


def number_text(value: float) -> str:
    """Return a number for a message, short whatever its size."""
    try:
        return f"{value:g}"
    except OverflowError:
        return "a number beyond 1e308"


def without_path(text: str, path: object) -> str:
    """Return the message of an error without the path that it begins with."""
    return text.removeprefix(printable(f"{path}: "))


class FpmatchError(Exception):
    """Base of every error that fpmatch raises on purpose.

    Parameters
    ----------
    message : str
        What is wrong, on one line: control characters in it are escaped, and a very long
        one is shortened, as by `fpmatch.printable.message_text`.
    path : str or path-like, optional
        File or database at fault; it is put before the message.
    code : str, optional
        Short fixed name of the reason, for programs and tests.

    Examples
    --------
    >>> from fpmatch.errors import GalleryError
    >>> error = GalleryError("no such gallery", path="prints.db", code="missing")
    >>> str(error), error.path, error.detail, error.code
    ('prints.db: no such gallery', 'prints.db', 'no such gallery', 'missing')
    """

    def __init__(self, message: str = "", *, path: object = "", code: str = "") -> None:
        self.path, self.detail, self.code = str(path), message_text(message), code
        super().__init__(message_text(f"{path}: {message}" if self.path else message))


class ImageReadError(FpmatchError):
    """A file could not be read as an image: missing, empty, truncated, or of another format."""


class ImageError(FpmatchError):
    """An image was read but cannot be a fingerprint image: wrong shape, size or pixel values."""


class QualityError(FpmatchError):
    """The image of a print is worse than required."""


class ResolutionError(FpmatchError):
    """A resolution (dpi) lies outside what a fingerprint scanner delivers."""


class MinutiaeError(FpmatchError):
    """Minutiae or template arrays disagree in length, are not finite, or leave their range."""


class PointSetError(FpmatchError):
    """A bare point set is malformed: wrong shape, too few points, or not finite."""


class TemplateError(FpmatchError):
    """A template file could not be read or written."""


class DatasetError(FpmatchError):
    """A database, manifest, list of pairs or file of scores cannot be read or evaluated."""


class MatcherError(FpmatchError):
    """An unknown matcher, a threshold or rate outside its range, or arrays it cannot use."""


class OutputError(FpmatchError):
    """A result could not be written to the requested place."""


class EngineError(FpmatchError):
    """Work could not be done where it was sent: a worker died, or no scheduler answers."""


class GalleryError(FpmatchError):
    """A gallery could not be opened, read or written, or something could not be found in it."""


class EncryptionError(FpmatchError):
    """A key is missing or malformed, or encrypted data are damaged or were moved."""


class ScoringError(FpmatchError):
    """Pairs could not be scored: a malformed list, or an unfinished run of something else."""
