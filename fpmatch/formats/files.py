"""Load and save template files, whatever their format."""

from __future__ import annotations

import stat
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.formats.an2 import holds_image
from fpmatch.formats.record import ReadingOptions, TemplateRecord, View
from fpmatch.formats.registry import codec_of_content, codec_of_name, codec_of_suffix
from fpmatch.output import atomic_write_bytes

if TYPE_CHECKING:
    import os

    from fpmatch.minutiae import Template

MAX_TEMPLATE_BYTES: Final = ReadingOptions().limits.max_bytes
HEAD_BYTES: Final = 4096  # enough to recognise a template file


def load_template(path: str | os.PathLike[str]) -> Template:
    """Load a template file; its format is found by its content.

    Parameters
    ----------
    path : path-like
        A file in any format of docs/reference/formats.md: fpmatch's own JSON and CSV,
        ISO/IEC 19794-2, ANSI/INCITS 378, NIST's XYT and MIN, ANSI/NIST-ITL type 9.

    Returns
    -------
    Template
        The first print in it. `load_record` returns all, and the rest of the content.

    Raises
    ------
    TemplateError
        If the file is missing, unreadable, of no known format, or breaks its format's rules.
    """
    return load_record(path).views[0].template


def load_record(
    path: str | os.PathLike[str],
    *,
    file_format: str | None = None,
    how: ReadingOptions | None = None,
) -> TemplateRecord:
    """Load all prints of a template file, and the rest of its content.

    Parameters
    ----------
    path : path-like
        A template file.
    file_format : str, optional
        Name of its format (default: found by its content).
    how : ReadingOptions, optional
        Values for what the file lacks, and limits (default: `ReadingOptions()`).

    Returns
    -------
    TemplateRecord
        Its prints, one at least.

    Raises
    ------
    TemplateError
        If the file is missing, unreadable, of no known format, or breaks its format's rules or
        the limits.
    """
    how = ReadingOptions() if how is None else how
    data = _read(path, how.limits.max_bytes)
    return decode_record(data, str(path), file_format=file_format, how=how)


def decode_record(
    data: bytes, source: str, *, file_format: str | None = None, how: ReadingOptions | None = None
) -> TemplateRecord:
    """Return all prints in the bytes of a template file, as `load_record` does of the file.

    Parameters
    ----------
    data : bytes
        The whole file.
    source : str
        What it is called in messages.
    file_format, how
        As for `load_record`.

    Returns
    -------
    TemplateRecord
        Its prints, one at least.

    Raises
    ------
    TemplateError
        As `load_record` does.
    """
    how = ReadingOptions() if how is None else how
    if not data:
        raise TemplateError(f"{source}: the file is empty")
    if len(data) > how.limits.max_bytes:
        raise TemplateError(f"{source}: too large for a template file")
    try:
        codec = codec_of_name(file_format) if file_format else codec_of_content(data)
        return codec.decode(data, how)
    except FpmatchError as error:
        raise TemplateError(f"{source}: {error}") from error


def save_template(
    path: str | os.PathLike[str], template: Template, *, file_format: str | None = None
) -> tuple[str, ...]:
    """Save a template in the format that the suffix of `path` names.

    The file appears whole or not at all: it is written beside its place and then moved there.

    Parameters
    ----------
    path : path-like
        Ends in ``.json`` (keeps everything), ``.csv`` (all but the ridge field), ``.iso``
        (ISO/IEC 19794-2:2005), ``.xyt``, or another suffix of docs/reference/formats.md.
    template : Template
        What to save.
    file_format : str, optional
        Name of the format (default: by the suffix).

    Returns
    -------
    tuple of str
        What the format could not hold, each in a few words; empty where nothing was lost but
        rounding.

    Raises
    ------
    TemplateError
        If the suffix names no known format, or the format cannot hold such a template.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from fpmatch.minutiae import Minutiae, Template
    >>> template = Template(Minutiae(x=[10], y=[20], angle=[1.5]), width=100, height=120)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     notes = save_template(Path(folder, "print.csv"), template)
    ...     load_template(Path(folder, "print.csv")) == template
    True
    """
    return save_record(path, TemplateRecord("", (View(template),)), file_format=file_format)


def save_record(
    path: str | os.PathLike[str], record: TemplateRecord, *, file_format: str | None = None
) -> tuple[str, ...]:
    """Save prints with what is known of them, as `save_template` does.

    Parameters
    ----------
    path : path-like
        Where to.
    record : TemplateRecord
        The prints; its own format does not matter.
    file_format : str, optional
        Name of the format (default: by the suffix of `path`).

    Returns
    -------
    tuple of str
        What the format could not hold.

    Raises
    ------
    TemplateError
        If the format is unknown, only read, or cannot hold such prints.
    OutputError
        If the file cannot be written.
    """
    codec = codec_of_name(file_format) if file_format else codec_of_suffix(path)
    if codec.encode is None:
        raise TemplateError(f"{path}: {codec.title} is only read, not written")
    try:
        encoded = codec.encode(record)
    except FpmatchError as error:
        raise TemplateError(f"{path}: {error}") from error
    atomic_write_bytes(path, encoded.data)
    return encoded.notes


def is_template_file(path: str | os.PathLike[str]) -> bool:
    """Tell by its first bytes whether a file is meant to be a template.

    Parameters
    ----------
    path : path-like
        Any path.

    Returns
    -------
    bool
        False also where there is no such file, or it cannot be read.
    """
    try:
        if not stat.S_ISREG(Path(path).stat().st_mode):
            return False
        with Path(path).open("rb") as stream:
            head = stream.read(HEAD_BYTES)
    except (OSError, ValueError):
        return False
    return begins_as_template(head)


def begins_as_template(data: bytes) -> bool:
    """Tell by how its bytes begin whether a file is meant to be a template.

    Examples
    --------
    >>> begins_as_template(b'{"format": "fpmatch-template"'), begins_as_template(b"P5 60 50 255 ")
    (True, False)
    """
    try:
        codec_of_content(data[:HEAD_BYTES])
    except TemplateError:
        return data.startswith(b"FMR\x00")
    return True


def holds_minutiae_only(path: str | os.PathLike[str]) -> bool:
    """Tell a template file that has no image beside its minutiae.

    Parameters
    ----------
    path : path-like
        Any path.

    Returns
    -------
    bool
        True for all template files but those of ANSI/NIST-ITL that have a record of an image.
    """
    if not is_template_file(path):
        return False
    with Path(path).open("rb") as stream:
        return is_of_minutiae_only(stream.read(HEAD_BYTES))


def is_of_minutiae_only(data: bytes) -> bool:
    """Tell as `holds_minutiae_only` does, by how the bytes of the file begin."""
    head = data[:HEAD_BYTES]
    return begins_as_template(head) and not holds_image(head)


def _read(path: str | os.PathLike[str], most: int) -> bytes:
    """Return the bytes of the regular file at `path`, or one more than `most`."""
    try:
        if Path(path).is_dir():
            raise TemplateError(f"{path}: is a folder, not a template file")
        if not Path(path).exists():
            raise TemplateError(f"{path}: no such file")
        if not Path(path).is_file():
            raise TemplateError(f"{path}: is not a regular file")
        with Path(path).open("rb") as stream:
            data = stream.read(most + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise TemplateError(f"{path}: {reason}") from error
    return data
