"""Load and save template files of all formats."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.base.output import atomic_write_bytes
from fpmatch.base.parsing import read_regular
from fpmatch.errors import FpmatchError, TemplateError
from fpmatch.formats.record import MAX_BYTES, AngleConvention, ReadingOptions, TemplateRecord, View
from fpmatch.formats.registry import codec_of_name, codec_of_suffix, failures_text, recognise
from fpmatch.formats.tables import NPY_CODEC, PLAIN_CODEC, TEXT_CODEC, recognises_text
from fpmatch.templates.bounds import check_bounds

if TYPE_CHECKING:
    import os

    from fpmatch.templates.minutiae import Template

_NO_TEMPLATES: Final = ("a folder, not a template file", "not a regular file")


def load_template(path: str | os.PathLike[str], *, angles: str | None = None) -> Template:
    """Load the first print of a template file.

    Parameters
    ----------
    path : path-like
        A file in any format of docs/reference/formats.md, recognised by its content: fpmatch's own
        JSON and CSV, ISO/IEC 19794-2, ANSI/INCITS 378, NIST's XYT, ANSI/NIST-ITL type 9,
        tables and arrays of x, y, angle.
    angles : str, optional
        How a table or array measures angles, where it does not define it: "deg" or "rad", then
        ",clockwise" where they increase clockwise on screen, ",opposite" where directions are
        opposite to those of ISO/IEC 19794-2.

    Returns
    -------
    Template
        The first print. `load_record` returns all prints and their metadata.

    Raises
    ------
    TemplateError
        If the file is missing, unreadable, of no known format, or invalid, or `angles` is no such
        text, or is given for a format that defines its angles.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from fpmatch import load_template
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.save(Path(folder, "print.npy"), [[10, 20, 1.5], [30, 40, 3.0]])
    ...     load_template(Path(folder, "print.npy"), angles="rad,clockwise")
    Template(31 x 41 px, 500 dpi, 2 minutiae)
    """
    convention = None if angles is None else AngleConvention.parse(angles)
    return load_record(path, options=ReadingOptions(angles=convention)).views[0].template


def load_record(
    path: str | os.PathLike[str],
    *,
    file_format: str | None = None,
    options: ReadingOptions | None = None,
) -> TemplateRecord:
    """Load all prints of a template file, of the given format or that of its content."""
    options = ReadingOptions() if options is None else options
    data = read_regular(path, MAX_BYTES, lambda why: TemplateError(f"{path}: {why}"), _NO_TEMPLATES)
    return decode_record(data, str(path), file_format=file_format, options=options)


def decode_record(
    data: bytes,
    source: str,
    *,
    file_format: str | None = None,
    options: ReadingOptions | None = None,
) -> TemplateRecord:
    """Return all prints in the bytes of a template file; error messages begin with `source`."""
    options = ReadingOptions() if options is None else options
    if not data:
        raise TemplateError(f"{source}: the file is empty")
    if len(data) > MAX_BYTES:
        raise TemplateError(f"{source}: too large for a template file")
    try:
        codec = codec_of_name(file_format) if file_format else recognise(data)
        if codec is None:
            raise TemplateError(f"not a template file of a known format{failures_text()}")
        if options.angles is not None and codec not in (PLAIN_CODEC, NPY_CODEC, TEXT_CODEC):
            if file_format or not recognises_text(data):  # whole numbers pass for XYT
                raise TemplateError(
                    f"{codec.title} defines how its angles are measured: --angles excludes it"
                )
            codec = TEXT_CODEC
        record = codec.decode(data, options)
        for view in record.views:
            check_bounds(view.template)
    except FpmatchError as error:
        raise TemplateError(f"{source}: {error}", code=error.code) from error
    return record


def save_template(
    path: str | os.PathLike[str], template: Template, *, file_format: str | None = None
) -> tuple[str, ...]:
    """Save a template, atomically, in the format of the suffix of `path`.

    Parameters
    ----------
    path : path-like
        Ends in ``.json`` (keeps everything), ``.csv`` (all but the ridge field), ``.iso``
        (ISO/IEC 19794-2:2005), ``.xyt``, or another suffix of docs/reference/formats.md.
    template : Template
        The template.
    file_format : str, optional
        Name of the format (default: by the suffix).

    Returns
    -------
    tuple of str
        A note on each part that the format cannot hold, apart from rounding.

    Raises
    ------
    TemplateError
        If the suffix or format is unknown, the format cannot hold such a template, or the two are
        given in the other order.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from fpmatch import load_template, save_template
    >>> from fpmatch.templates.minutiae import Minutiae, Template
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
    """Save prints with their metadata; parameters and errors are as for `save_template`."""
    codec = codec_of_name(file_format) if file_format else codec_of_suffix(path)
    if codec.encode is None:
        raise TemplateError(f"{path}: {codec.title} is only read, not written")
    try:
        encoded = codec.encode(record)
    except FpmatchError as error:
        raise TemplateError(f"{path}: {error}") from error
    atomic_write_bytes(path, encoded.data)
    return encoded.notes
