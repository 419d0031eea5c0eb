"""Which resolution holds: an option's, the file's, or the assumed one; what is doubtful is said."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from fpmatch.formats.record import TemplateRecord
    from fpmatch.image.io.read import GreyImage
    from fpmatch.minutiae import Template


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
        return self._choose(image.source, image.dpi, image.notes, asked)

    def first_of(self, record: TemplateRecord, path: Path, asked: float | None = None) -> Template:
        """Return the first print of a template file at the resolution that holds.

        The same is said as of an image, and that there are other prints.

        Raises
        ------
        ResolutionError
            If `asked` is outside 100 to 4000 dpi.
        """
        view = record.views[0]
        told = view.template.dpi if view.dpi_known else None
        dpi = self._choose(str(path), told, record.notes, asked)
        if len(record.views) > 1:
            self._say_once(
                str(path), f"{path}: the first of its {len(record.views)} prints is taken"
            )
        return view.at(dpi).template

    def _choose(
        self, source: str, told: float | None, notes: Iterable[str], asked: float | None
    ) -> float:
        from fpmatch.minutiae import STANDARD_DPI, check_dpi

        for note in notes:
            self._say_once(note, f"{source}: {note}")
        if asked is not None:
            return check_dpi(asked)
        if told is not None:
            return told
        self._say_once(
            "assumed",
            f"{source} does not tell its resolution; "
            f"{STANDARD_DPI:g} dpi assumed ({self._hint} sets it)",
        )
        return STANDARD_DPI

    def _say_once(self, what: str, words: str) -> None:
        if what not in self._said:
            click.echo(f"fpmatch: note: {words}", err=True)
            self._said.add(what)
