"""`fpmatch extract`: templates of many images, or of a gallery."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

import click

from fpmatch.cli.command import Command, check_combination, load_object
from fpmatch.cli.given_files import given_files
from fpmatch.cli.notes import say_errors, say_note, say_notes, say_slow_kernels, show
from fpmatch.cli.options import (
    MIRROR,
    PRINT,
    RECORD,
    FormatChoice,
    angles_option,
    enhance_option,
    files_argument,
    json_option,
    output_option,
    reading_options,
)
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import FpmatchError, OutputError, TemplateError
from fpmatch.formats.registry import codec_of_name, written_formats
from fpmatch.printable import count, json_text, printable

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.formats.record import AngleConvention
    from fpmatch.image.io.grey import RawSize
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.prints.reading import GivenPrint
    from fpmatch.templates.minutiae import Template

OWN_FORMATS: Final = {"json": ("json",), "csv": ("csv",), "both": ("json", "csv")}
STAGES: Final = "stages"  # in place of a format: pictures
_OF_IMAGES: Final = (
    *("images", "dpi", "polarity", "raw", "record", "mirror", "enhance", "angles", "as_json"),
)


@dataclass(frozen=True, slots=True)
class _Extracted:
    """What came of one image; `quality` is None for a template and for stages."""

    image: Path
    files: tuple[Path, ...]
    minutiae: int
    quality: PrintQuality | None
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the object that ``--json`` prints."""
        return {
            "image": str(self.image),
            "files": list(map(str, self.files)),
            "minutiae": self.minutiae,
            "quality": None if self.quality is None else self.quality.as_dict(),
        }


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  fpmatch extract print.tif -o templates
  fpmatch extract prints -o templates --format json --dpi 569
  fpmatch extract prints/*.tif -o templates --format iso2005
  fpmatch extract minutiae/*.csv -o templates --angles rad,clockwise
  fpmatch extract prints/*.tif -o templates --json
  fpmatch extract print.tif -o stages --format stages
  fpmatch extract --gallery prints.db -o templates
  fpmatch extract - -o templates < print.tif

\b
Quality:
  0, useless, to 100; what is wrong with an image is a note on stderr. --json contains all of it.

Exit status: 0 when every template is written, 1 when damaged entries of a gallery were skipped, 2
when an image failed; the others are kept.
""",
)
@files_argument("images", metavar="IMAGE|DIR...", type=PRINT, required=False)
@output_option(metavar="DIR", help="Folder for the templates; made if missing.")
@click.option(
    "--format",
    "file_format",
    type=FormatChoice([*OWN_FORMATS, STAGES, *written_formats()]),
    default="both",
    help="json is complete; csv has the minutiae alone; stages are no templates but pictures of "
    "every stage, in a folder for each IMAGE; the others are as for convert.",
)
@click.option(
    "--gallery",
    metavar="GALLERY",
    hidden=True,
    help="Write the templates of this gallery, instead of images, named by subject, finger and "
    "impression: 101_3.json. The variable FPMATCH_KEY names the keys of an encrypted one.",
)
@click.option("--subject", metavar="ID", hidden=True, help="With --gallery: of this subject only.")
@reading_options
@RECORD
@MIRROR
@enhance_option
@angles_option
@json_option
def extract(
    images: tuple[Path, ...],
    output: Path,
    file_format: str,
    gallery: str | None,
    subject: str | None,
    dpi: float | None,
    polarity: Polarity,
    enhance: str,
    raw: tuple[RawSize, ...],
    record: int | None,
    mirror: bool,
    angles: AngleConvention | None,
    as_json: bool,
) -> int:
    """Write the template of each IMAGE, or template file, into a folder, under its name.

    Of DIR, its images are taken or, if it has none, its templates, else the prints of its
    subfolders, each into a subfolder of that name.

    Positions are pixels of the image, from the top left, y down; directions follow
    ISO/IEC 19794-2, counter-clockwise from the x axis.
    """
    from fpmatch.base.folders import make_folder
    from fpmatch.base.output import check_writable
    from fpmatch.prints.reading import PrintReader, group_by_note, make_given_print

    check_combination({"subject": "gallery"}, excluding="gallery", excluded=_OF_IMAGES)
    if gallery is not None:
        if file_format == STAGES:
            raise click.UsageError("--format stages cannot be combined with --gallery")
        export = load_object(
            "fpmatch.gallery.cli.export:export_gallery", used_by="extract --gallery"
        )
        return cast("int", export(gallery, output, file_format, subject))
    if not images:
        raise click.MissingParameter(param_hint="'IMAGE|DIR...'", param_type="argument")
    reader = PrintReader(raw, quiet=True, angles=angles, record=record, mirror=mirror)
    files = given_files(images, reader, polarity=polarity, dpi=dpi)
    stems = [file.place.parent / file.path.stem for file in files]
    _refuse_shared_names([file.path for file in files], stems)
    if output.exists():
        make_folder(output)  # fails for a file
    check_writable(output / files[0].path.name)
    if len(files) > 1:
        say_slow_kernels()
    failures: list[FpmatchError] = []
    done: list[_Extracted] = []
    with ProgressBars({"extract": "extracting"}) as bars:
        for number, (file, stem) in enumerate(zip(files, stems, strict=True), start=1):
            try:
                how: dict[str, Any] = {"dpi": file.dpi, "enhance": enhance}
                given = make_given_print(file.read(file.path), str(file.path), **how)
                if file_format == STAGES:
                    written = _draw(given, file.path, output / stem)
                else:
                    written = _write(given.template, output / stem, file_format)
                minutiae = len(given.template.minutiae)
                quality = None if file_format == STAGES else given.quality
                done.append(_Extracted(file.path, written, minutiae, quality, given.notes))
            except OutputError as error:
                failures.append(error)
                break
            except FpmatchError as error:
                failures.append(error)
            bars.show("extract", number, len(files))
    templates = [one.as_dict() for one in done]
    document = {"templates": templates, "failures": list(map(str, failures))}
    show(
        json_text(document)
        if as_json
        else printable(_as_text(done, len(files), output, file_format))
    )
    say_notes(group_by_note((one.image, one.notes) for one in done))
    for one in done:
        if one.quality is not None and one.quality.reasons:
            say_note(f"{one.image}: {one.quality}")
    say_errors(failures)
    return 2 if failures else 0


def _as_text(done: Sequence[_Extracted], images: int, output: Path, file_format: str) -> str:
    minutiae = sum(one.minutiae for one in done)
    scores = sorted(one.quality.score for one in done if one.quality is not None)
    quality = f", quality {scores[0]}" if scores else ""
    quality += f" to {scores[-1]}" if len(set(scores)) > 1 else ""
    counted = count(minutiae, "minutia", "minutiae")
    made = count(images, "image" if file_format == STAGES else "template")
    return f"{len(done)} of {made}, {counted}{quality}: {output}"


def _draw(given: GivenPrint, image: Path, folder: Path) -> tuple[Path, ...]:
    """Write the stages of the extraction of an image as pictures into a folder."""
    from fpmatch.drawing.stages import write_stages

    if given.assessed is None:
        raise TemplateError("a template has no stages: give its image", path=image)
    return tuple(write_stages(given.assessed.stages(), folder))


def _write(template: Template, stem: Path, file_format: str) -> tuple[Path, ...]:
    """Write a template under `stem`, print what its format cannot hold, return the files."""
    from fpmatch.formats.files import save_template

    names = OWN_FORMATS.get(file_format, (file_format,))
    files = tuple(stem.with_name(stem.name + codec_of_name(name).suffixes[0]) for name in names)
    for path, name in zip(files, names, strict=True):
        notes = save_template(path, template, file_format=name)
        for note in notes if file_format not in OWN_FORMATS else ():
            say_note(f"{path}: {note}")
    return files


def _refuse_shared_names(images: Sequence[Path], stems: Sequence[Path]) -> None:
    """Raise OutputError where two images would write the same file, on any file system."""
    by_name: dict[str, Path] = {}
    for image, stem in zip(images, stems, strict=True):
        other = by_name.setdefault(str(stem).casefold(), image)
        if other is not image:
            raise OutputError(
                f"{other} and {image} would both be written as {other.stem}; "
                "give them folders of their own"
            )
