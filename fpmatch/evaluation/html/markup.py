"""HTML from Python: every text is escaped, every element closed."""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING, NewType

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

Html = NewType("Html", str)
"""Text that is HTML already."""


def text(words: str) -> Html:
    """Return words as HTML.

    Examples
    --------
    >>> text("a < b")
    'a &lt; b'
    """
    return Html(escape(words))


def element(tag: str, *content: Html, **attributes: str) -> Html:
    """Return an element; `class_` and the like lose the underscore.

    Examples
    --------
    >>> element("p", text("R&D"), class_="note")
    '<p class="note">R&amp;D</p>'
    """
    named = "".join(f' {k.rstrip("_")}="{escape(v)}"' for k, v in attributes.items())
    return Html(f"<{tag}{named}>{''.join(content)}</{tag}>")


def paragraph(words: str, **attributes: str) -> Html:
    """Return a paragraph of words."""
    return element("p", text(words), **attributes)


def bullets(items: Iterable[str]) -> Html:
    """Return a list of words."""
    return element("ul", *(element("li", text(item)) for item in items))


def joined(parts: Iterable[Html]) -> Html:
    """Return pieces of HTML one after the other."""
    return Html("\n".join(parts))


def table(head: Sequence[str], rows: Iterable[Sequence[Html]], *, strong: int = 0) -> Html:
    """Return a table whose first column names the rows.

    Parameters
    ----------
    head : sequence of str
        Titles of the columns.
    rows : iterable of sequences of Html
        The cells.
    strong : int
        How many rows at the end stand out.

    Returns
    -------
    Html
        The table, in a box that scrolls where the page is narrow.
    """
    listed = list(rows)
    first_strong = len(listed) - strong
    body = [
        element(
            "tr",
            element("th", row[0], scope="row"),
            *(element("td", cell) for cell in row[1:]),
            **({"class_": "strong"} if n >= first_strong else {}),
        )
        for n, row in enumerate(listed)
    ]
    titles = element("tr", *(element("th", text(title), scope="col") for title in head))
    return element(
        "div",
        element("table", element("thead", titles), element("tbody", *body)),
        class_="scrolls",
    )


def picture(content: bytes, alt: str) -> Html:
    """Return an image, the bytes of a WebP, that needs no other file; a click enlarges it."""
    data = base64.b64encode(content).decode("ascii")
    image = Html(f'<img alt="{escape(alt)}" src="data:image/webp;base64,{data}">')
    switch = Html('<input type="checkbox" aria-label="enlarge">')
    return element("label", switch, image)
