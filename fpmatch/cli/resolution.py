"""Which resolution holds: an option's, the file's, or the assumed one; what is doubtful is said."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from fpmatch.image.read import GreyImage


class ResolutionChoice:
    """Choose resolutions for the images of one command, and say what was noticed on reading them.

    Parameters
    ----------
    hint : str
        The option that sets the resolution, for the note.
    """

    def __init__(self, hint: str = "--dpi") -> None:
        self._hint = hint
        self._said: set[str] = set()

    def of(self, image: GreyImage, asked: float | None = None) -> float:
        """Return the resolution of `image` in dpi: `asked`, else its own, else 500.

        The first time that 500 is assumed, a note on stderr says so; what was noticed on reading
        the image (white ridges, say) is said so too, each once.

        Raises
        ------
        ResolutionError
            If `asked` is outside 100 to 4000 dpi.
        """
        from fpmatch.minutiae import STANDARD_DPI, check_dpi

        for note in image.notes:
            self._say_once(note, f"{image.source}: {note}")
        if asked is not None:
            return check_dpi(asked)
        if image.dpi is not None:
            return image.dpi
        self._say_once(
            "assumed",
            f"{image.source} does not tell its resolution; "
            f"{STANDARD_DPI:g} dpi assumed ({self._hint} sets it)",
        )
        return STANDARD_DPI

    def _say_once(self, what: str, words: str) -> None:
        if what not in self._said:
            click.echo(f"fpmatch: note: {words}", err=True)
            self._said.add(what)
