"""Which resolution holds: an option's, the file's, or the assumed one, said once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from fpmatch.image.read import GreyImage


class ResolutionChoice:
    """Choose resolutions for the images of one command.

    Parameters
    ----------
    hint : str
        The option that sets the resolution, for the note.
    """

    def __init__(self, hint: str = "--dpi") -> None:
        self._hint = hint
        self._said = False

    def of(self, image: GreyImage, asked: float | None = None) -> float:
        """Return the resolution of `image` in dpi: `asked`, else its own, else 500.

        The first time that 500 is assumed, a note on stderr says so.

        Raises
        ------
        ResolutionError
            If `asked` is outside 100 to 4000 dpi.
        """
        from fpmatch.minutiae import STANDARD_DPI, check_dpi

        if asked is not None:
            return check_dpi(asked)
        if image.dpi is not None:
            return image.dpi
        if not self._said:
            click.echo(
                f"fpmatch: note: {image.source} does not tell its resolution; "
                f"{STANDARD_DPI:g} dpi assumed ({self._hint} sets it)",
                err=True,
            )
            self._said = True
        return STANDARD_DPI
