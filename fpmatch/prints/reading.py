"""Read a print: an image, from which a template is extracted, or a template file.

The format is found by content, never by name. Commands, web interface and galleries all read
prints by these functions.
"""

from __future__ import annotations

import os
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, TypeVar

import numpy as np

from fpmatch.base.parsing import HEAD_BYTES, read_head
from fpmatch.errors import ImageReadError
from fpmatch.image.dataset_folder import folder_settings
from fpmatch.image.extract import DEFAULT_ENHANCEMENT, AssessedPrint, assess
from fpmatch.image.io.grey import DEFAULT_LIMITS
from fpmatch.image.io.read import GreyImage, decode_image, read_image, sniff
from fpmatch.image.quality.ridge_scale import PERIODS_PX, clear_period_px
from fpmatch.templates.minutiae import STANDARD_DPI, check_dpi
from fpmatch.templates.plausibility import find_doubts

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from fpmatch.formats.record import AngleConvention, TemplateRecord
    from fpmatch.image.io.grey import ImageLimits, RawSize
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.templates.minutiae import Template

Name = TypeVar("Name")
Read = TypeVar("Read", "GreyImage", "TemplateRecord")
DpiSource = Literal["given", "stated", "found", "assumed"]
"""Where a resolution comes from: the caller, the file, the ridges or a match, nowhere."""
Content = Literal["image", "template", "both", ""]
"""What a file is: an image, minutiae, a record with both, none that is known by its beginning."""

UNKNOWN_DPI: Final = "resolution unknown; "
ASSUMED_DPI: Final = f"{UNKNOWN_DPI}{STANDARD_DPI:g} dpi assumed"
FOUND_DPI: Final = f"{UNKNOWN_DPI}{{:g}} dpi by its ridges"
COMMON_DPI: Final = f"{UNKNOWN_DPI}{{:g}} dpi by the ridges of the prints with it"
MATCHED_DPI: Final = f"{UNKNOWN_DPI}{{:g}} dpi by its ridges and the match"
MIRRORED: Final = "left and right are exchanged"
_STDERR: Final = 2


@dataclass(frozen=True, slots=True)
class PrintReader:
    """Read files of prints, also in worker processes; files of `raw_sizes` have no header.

    `angles` is how tables of minutiae measure them, where they do not define it themselves;
    `record` is the number, from 1, of the print that is read of files with several; with `mirror`,
    left and right of what is read are exchanged. With `quiet`, what C libraries write to stderr
    about damaged files is suppressed, in programs that read on one thread.
    """

    raw_sizes: tuple[RawSize, ...] = ()
    quiet: bool = False
    angles: AngleConvention | None = None
    record: int | None = None
    mirror: bool = False

    def __call__(
        self, path: Path, *, polarity: Polarity = "auto", dpi: float | None = None
    ) -> GreyImage | TemplateRecord:
        """Read a file of minutiae alone as a template, and any other file as an image."""
        head = read_head(path)
        content = content_of(head)
        if content == "template":
            from fpmatch.formats.files import load_record  # noqa: PLC0415  (imports all formats)
            from fpmatch.formats.record import ReadingOptions  # noqa: PLC0415

            loaded = load_record(path, options=ReadingOptions(angles=self.angles))
            if self.record is not None and len(loaded.views) > 1:
                loaded = loaded.of_view(self.record, path)
            return _mirrored(loaded) if self.mirror else loaded
        try:
            return self.image(path, polarity=polarity, dpi=dpi)
        except ImageReadError as error:
            if content or not head:
                raise
            from fpmatch.formats.registry import failures_text  # noqa: PLC0415

            raise ImageReadError(f"{error}{failures_text()}") from error

    def image(
        self, path: Path, *, polarity: Polarity = "auto", dpi: float | None = None
    ) -> GreyImage:
        """Read an image as `fpmatch.image.io.read.read_image` does."""
        with _silence_c_libraries() if self.quiet else nullcontext():
            image = read_image(
                path, raw_sizes=self.raw_sizes, polarity=polarity, dpi=dpi, record=self.record
            )
        return _mirrored(image) if self.mirror else image


def decode_print(
    data: bytes,
    name: str,
    limits: ImageLimits = DEFAULT_LIMITS,
    *,
    dpi: float | None = None,
) -> GreyImage | TemplateRecord:
    """Decode the bytes of a file as `PrintReader` reads the file; messages call it `name`."""
    if content_of(data) != "template":
        return decode_image(data, name, limits=limits, dpi=dpi)
    from fpmatch.formats.files import decode_record  # noqa: PLC0415

    return decode_record(data, name)


@dataclass(frozen=True, eq=False)
class GivenPrint:
    """A print that was given for comparison, the name of its file, and notes on it.

    A print that was given as a template has no `image`, and no extraction, `assessed`.
    """

    name: str
    template: Template
    image: GreyImage | None = None
    notes: tuple[str, ...] = ()
    assessed: AssessedPrint | None = None
    dpi_source: DpiSource = "stated"
    enhance: str = DEFAULT_ENHANCEMENT

    @cached_property
    def quality(self) -> PrintQuality | None:
        """Quality of the image; None for a template."""
        if self.assessed is None:
            return None
        quality = self.assessed.quality
        return quality.at_found_resolution() if self.dpi_source == "found" else quality

    @property
    def dpi_assumed(self) -> bool:
        """Whether nothing indicates the resolution."""
        return self.dpi_source == "assumed"

    @property
    def dpi_stated(self) -> bool:
        """Whether the file or the caller states the resolution."""
        return self.dpi_source in {"given", "stated"}

    @cached_property
    def ridge_period_px(self) -> float | None:
        """Distance of the ridges of an image; None for a template, and where it is not clear."""
        return None if self.image is None else clear_period_px(self.image.pixels)

    @property
    def doubted_resolution(self) -> tuple[str, ...]:
        """The reason of quality that names a resolution which the ridges contradict, if any."""
        if self.ridge_period_px is None or self.dpi_source == "found":
            return ()
        period_px = self.ridge_period_px * STANDARD_DPI / self.template.dpi  # at 500 dpi
        if PERIODS_PX[0] <= period_px <= PERIODS_PX[1]:
            return ()
        from fpmatch.image.quality.print_quality import wrong_resolution  # noqa: PLC0415

        return (str(wrong_resolution(period_px, self.template.dpi)),)

    def at(self, dpi: float) -> GivenPrint:
        """Return the print extracted at another resolution, which the match indicates."""
        if self.image is None or dpi == self.template.dpi:
            return self
        given = make_given_print(self.image, self.name, dpi=dpi, enhance=self.enhance)
        template = replace(given.template, dpi_known=False)
        notes = (*given.notes, MATCHED_DPI.format(dpi))
        return replace(given, template=template, notes=notes, dpi_source="found")


def dpi_source(
    template: Template, *, given: bool = False, among_others: bool = False
) -> tuple[DpiSource, tuple[str, ...]]:
    """Return where the resolution of a template comes from, and the note on one not stated.

    The caller has `given` it, or the ridges of the prints `among_others` it was read with show it.
    """
    if given:
        return "given", ()
    if template.dpi_known:
        return "stated", ()
    if template.dpi == STANDARD_DPI:
        return "assumed", (ASSUMED_DPI,)
    return "found", ((COMMON_DPI if among_others else FOUND_DPI).format(template.dpi),)


def make_given_print(
    content: GreyImage | TemplateRecord,
    name: str,
    *,
    dpi: float | None = None,
    enhance: str = DEFAULT_ENHANCEMENT,
) -> GivenPrint:
    """Return a print that was read, with the template of an image extracted.

    Of several prints in a record the first is taken; a template that no finger can have gets a
    note.
    """
    given_dpi = None if dpi is None else check_dpi(dpi)
    if not isinstance(content, GreyImage):
        view, several = content.views[0], len(content.views) > 1
        first = f"the first of its {len(content.views)} prints is used (--record chooses one)"
        template, image, assessed = view.at(given_dpi).template, None, None
        notes = ((first,) if several else ()) + find_doubts(template)
    else:
        notes, image = (), content
        assessed = assess(content, given_dpi, enhance=enhance)
        template = assessed.template
    common = image is not None and image.likely_dpi is not None
    source, on_dpi = dpi_source(template, given=given_dpi is not None, among_others=common)
    all_notes = (*content.notes, *notes, *on_dpi)
    return GivenPrint(name, template, image, all_notes, assessed, source, enhance)


def read_given_print(
    path: Path,
    read: Callable[..., GreyImage | TemplateRecord],
    *,
    polarity: Polarity = "auto",
    dpi: float | None = None,
    enhance: str = DEFAULT_ENHANCEMENT,
) -> GivenPrint:
    """Read one print, with `polarity` and `dpi` from its ``dataset.toml`` where not given.

    `read` is a `PrintReader`, or its method `image`; the rest is as for `make_given_print`.
    """
    polarity, dpi = folder_settings(path, polarity=polarity, dpi=dpi)
    content = read(path, polarity=polarity, dpi=dpi)
    return make_given_print(content, str(path), dpi=dpi, enhance=enhance)


def group_by_note(prints: Iterable[tuple[Name, Iterable[str]]]) -> dict[str, tuple[Name, ...]]:
    """Return each note, in the order of first appearance, with the prints that it is about."""
    by_note: dict[str, list[Name]] = {}
    for name, notes in prints:
        for note in notes:
            by_note.setdefault(note, []).append(name)
    return {note: tuple(names) for note, names in by_note.items()}


def _mirrored(content: Read) -> Read:
    """Return what was read with left and right exchanged."""
    notes = (*content.notes, MIRRORED)
    if isinstance(content, GreyImage):
        pixels = np.ascontiguousarray(content.pixels[:, ::-1])
        return replace(content, pixels=pixels, notes=notes)
    views = (replace(view, template=view.template.mirrored()) for view in content.views)
    return replace(content, views=tuple(views), notes=notes)


def content_of(file: str | os.PathLike[str] | bytes) -> Content:
    """Return the kind of a file, or of its bytes, by its beginning; "" if it cannot be read."""
    head = file[:HEAD_BYTES] if isinstance(file, bytes) else read_head(file)
    reader = sniff(head)
    if reader is not None and not reader.holds_several:  # then it is no template
        return "image"
    from fpmatch.formats.registry import holds_image, recognise  # noqa: PLC0415

    codec = recognise(head)
    if codec is None or codec.name != "an2":
        return "template" if codec else ""
    return "both" if holds_image(head) else "template"


@contextmanager
def _silence_c_libraries() -> Iterator[None]:
    """Redirect file descriptor 2, to which libtiff writes, to nowhere; Python's errors remain."""
    try:
        kept = os.dup(_STDERR)
    except OSError:  # closed by the caller (2>&-)
        yield
        return
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), _STDERR)
    try:
        yield
    finally:
        os.dup2(kept, _STDERR)
        os.close(kept)
