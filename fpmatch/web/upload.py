"""`Upload`: the bytes that somebody sent, under a name that is only ever shown."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final

LONGEST_NAME: Final = 80
_SEPARATORS: Final = re.compile(r"[/\\]")


@dataclass(frozen=True, slots=True)
class Upload:
    """Hold one file that was sent.

    Parameters
    ----------
    name : str
        What it is called in answers; no path is ever made of it.
    data : bytes
        Its content.
    """

    name: str
    data: bytes = field(repr=False)


def shown_name(given: str | None, otherwise: str) -> str:
    r"""Return the name of a file as answers may show it.

    Parameters
    ----------
    given : str or None
        What the client says it is called.
    otherwise : str
        What it is called where the client says nothing that can be shown.

    Returns
    -------
    str
        The last part of the name, on one line and not too long.

    Examples
    --------
    >>> shown_name("C:\\prints\\ada.tif", "probe"), shown_name("../..", "probe")
    ('ada.tif', 'probe')
    """
    last = _SEPARATORS.split(given or "")[-1]
    printable = "".join(letter for letter in last if letter.isprintable()).strip()
    if not printable.strip("."):
        return otherwise
    if len(printable) > LONGEST_NAME:
        return f"{printable[: LONGEST_NAME - 1]}…"
    return printable
