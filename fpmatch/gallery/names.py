"""Labels in the names of files."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from fpmatch.errors import GalleryError
from fpmatch.gallery.entry import Label

if TYPE_CHECKING:
    from pathlib import Path

FVC_PATTERN: Final = r"(?P<subject>\d+)_(?P<impression>\d+)"


@dataclass(frozen=True, slots=True)
class NamePattern:
    """Find labels in paths by a regular expression, by default that of FVC's names, ``101_3.tif``.

    It has a group named ``subject`` and, where names contain them, ``finger`` and ``impression``;
    raises GalleryError for another. It must match the end of the path, without the extension, from
    the beginning of a name in it on: one with a ``/`` matches folders, too.

    Examples
    --------
    >>> from pathlib import Path
    >>> NamePattern().label(Path("prints/101_3.tif"))
    Label(subject='101', finger='', impression='3')
    >>> by_folder = NamePattern("(?P<subject>[^/]+)/(?P<finger>[a-z]+)-(?P<impression>[0-9]+)")
    >>> by_folder.label(Path("prints/ada/index-2.png"))
    Label(subject='ada', finger='index', impression='2')
    >>> NamePattern().label(Path("holiday.jpg")) is None
    True
    """

    text: str = FVC_PATTERN

    def __post_init__(self) -> None:
        try:
            groups = re.compile(self.text).groupindex
        except (re.error, OverflowError, RecursionError) as error:
            why = f"not a regular expression: {error}"
            raise GalleryError(f"pattern {self.text!r}: {why}") from error
        if not {"subject"} <= set(groups) <= {"subject", "finger", "impression"}:
            raise GalleryError(
                f"pattern {self.text!r}: it must have a group (?P<subject>...), may have "
                "(?P<finger>...) and (?P<impression>...), and no other named one"
            )

    def label(self, path: Path) -> Label | None:
        """Return the label in a path, None where the pattern does not match."""
        text = as_text(path.absolute().with_suffix(""), separator="/")
        expression = re.compile(self.text)
        start = len(text)
        while start > 0:
            start = text.rfind("/", 0, start)
            match = expression.fullmatch(text, start + 1)
            if match is not None and match["subject"]:
                return Label(**match.groupdict(""))
        return None


def as_text(path: Path, separator: str = os.sep) -> str:
    """Return a path as text that any database accepts, whatever bytes are in its names."""
    name = os.fsencode(path).decode("utf-8", "backslashreplace")
    return name.replace(os.sep, separator)
