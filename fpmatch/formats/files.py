"""Load and save template files, whatever their format."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.formats.registry import codec_of_content, codec_of_suffix
from fpmatch.output import write_whole

if TYPE_CHECKING:
    import os

    from fpmatch.minutiae import Template

MAX_TEMPLATE_BYTES: Final = 16 * 2**20  # a hundred times what a full palm print takes


def load_template(path: str | os.PathLike[str]) -> Template:
    """Load a template file; its format is found by its content.

    Parameters
    ----------
    path : path-like
        A file that `save_template` or another writer of a known format made.

    Returns
    -------
    Template
        What the file holds.

    Raises
    ------
    TemplateError
        If the file is missing, unreadable, of no known format, or breaks its format's rules.
    """
    data = _read(path)
    try:
        return codec_of_content(data).decode(data)
    except FpmatchError as error:
        raise TemplateError(f"{path}: {error}") from error


def save_template(path: str | os.PathLike[str], template: Template) -> None:
    """Save a template in the format that the suffix of `path` names.

    The file appears whole or not at all: it is written beside its place and then moved there.

    Parameters
    ----------
    path : path-like
        Ends in ``.json`` (keeps everything) or ``.csv`` (keeps all but the ridge field).
    template : Template
        What to save.

    Raises
    ------
    TemplateError
        If the suffix names no known format.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from fpmatch.minutiae import Minutiae, Template
    >>> template = Template(Minutiae(x=[10], y=[20], angle=[1.5]), width=100, height=120)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_template(Path(folder, "print.csv"), template)
    ...     load_template(Path(folder, "print.csv")) == template
    True
    """
    write_whole(path, codec_of_suffix(path).encode(template))


def _read(path: str | os.PathLike[str]) -> bytes:
    """Return the bytes of the regular file at `path`, not empty and not absurdly many."""
    try:
        if Path(path).is_dir():
            raise TemplateError(f"{path}: is a folder, not a template file")
        if not Path(path).exists():
            raise TemplateError(f"{path}: no such file")
        if not Path(path).is_file():
            raise TemplateError(f"{path}: is not a regular file")
        with Path(path).open("rb") as stream:
            data = stream.read(MAX_TEMPLATE_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise TemplateError(f"{path}: {reason}") from error
    if not data:
        raise TemplateError(f"{path}: the file is empty")
    if len(data) > MAX_TEMPLATE_BYTES:
        raise TemplateError(f"{path}: too large for a template file")
    return data
