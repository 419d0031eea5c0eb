"""`fpmatch extract`: templates of many images."""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.enhance import enhance_option
from fpmatch.cli.polarity import polarity_option
from fpmatch.cli.prints import open_print
from fpmatch.cli.raw import raw_option
from fpmatch.cli.reading import read_print
from fpmatch.cli.resolution import ResolutionChoice
from fpmatch.errors import FpmatchError, OutputError
from fpmatch.formats.registry import codec_of_name, written_formats

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.image.io.raw import RawSize
    from fpmatch.image.quality.polarity import Polarity
    from fpmatch.image.quality.print_quality import PrintQuality
    from fpmatch.minutiae import Template

OWN_FORMATS: Final = {"json": ("json",), "csv": ("csv",), "both": ("json", "csv")}
FORMATS: Final = OWN_FORMATS | {name: (name,) for name in written_formats()}


@click.command(
    epilog="""\b
Examples:
  fpmatch extract print.tif -o templates
  fpmatch extract prints/*.tif -o templates --format json --dpi 569
  fpmatch extract prints/*.tif -o templates --format iso2005
  fpmatch extract prints/*.tif -o templates --json

\b
Quality:
  0, of no use, to 100; what is wrong with an image is a note on stderr. All of it with --json.

Exit status: 0 when every template is written, 2 when an image failed; the others are kept.
"""
)
@click.argument(
    "images", metavar="IMAGE...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    required=True,
    type=click.Path(path_type=Path),
    help="Folder for the templates; made if missing.",
)
@click.option(
    "--format",
    "file_format",
    type=click.Choice(list(FORMATS)),
    default="both",
    show_default=True,
    help="JSON keeps everything; CSV the minutiae, for eyes; the others are those of convert.",
)
@click.option("--dpi", type=float, help="Resolution of all the images, in dots per inch.")
@polarity_option
@enhance_option
@raw_option
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.pass_context
def extract(
    ctx: click.Context,
    /,
    images: tuple[Path, ...],
    output: Path,
    file_format: str,
    dpi: float | None,
    polarity: Polarity,
    enhance: str,
    raw: tuple[RawSize, ...],
    as_json: bool,
) -> None:
    """Write the template of each IMAGE, or template file, into a folder, under its name.

    Positions are pixels of the image, from the top left, y down; directions follow
    ISO/IEC 19794-2, counter-clockwise from the x axis.
    """
    from fpmatch.image.quality.folder_polarity import find_polarities

    if dpi is not None:
        from fpmatch.minutiae import check_dpi

        check_dpi(dpi)
    _refuse_shared_names(images)
    _make_folder(output)
    resolution = ResolutionChoice()
    polarities = find_polarities(
        images, polarity=polarity, dpi=dpi, reader=partial(read_print, raw=raw)
    )
    failures: list[FpmatchError] = []
    done: list[_Extracted] = []
    with click.progressbar(
        images, label="extracting", file=sys.stderr, hidden=_no_progress(images)
    ) as bar:
        for image in bar:
            try:
                of_folder = polarities[image.parent]
                found = open_print(image, resolution, dpi, raw, enhance, of_folder)
                files = _write(found.template, output / image.stem, file_format)
                minutiae = len(found.template.minutiae)
                done.append(_Extracted(image, files, minutiae, found.quality()))
            except OutputError:
                raise
            except FpmatchError as error:
                failures.append(error)
    click.echo(_as_json(done, failures) if as_json else _in_words(done, len(images), output))
    for one in done:
        if one.quality is not None and one.quality.reasons:
            click.echo(f"fpmatch: note: {one.image}: {one.quality}", err=True)
    for failure in failures:
        click.echo(f"fpmatch: error: {failure}", err=True)
    ctx.exit(2 if failures else 0)


@dataclass(frozen=True, slots=True)
class _Extracted:
    """What came of one image; quality None where it was a template."""

    image: Path
    files: tuple[Path, ...]
    minutiae: int
    quality: PrintQuality | None


def _in_words(done: Sequence[_Extracted], images: int, output: Path) -> str:
    minutiae = sum(one.minutiae for one in done)
    scores = sorted(one.quality.score for one in done if one.quality is not None)
    quality = f", quality {scores[0]}" if scores else ""
    quality += f" to {scores[-1]}" if len(set(scores)) > 1 else ""
    return f"{len(done)} of {images} templates, {minutiae} minutiae{quality}: {output}"


def _as_json(done: Sequence[_Extracted], failures: Sequence[FpmatchError]) -> str:
    templates: list[dict[str, Any]] = [
        {
            "image": str(one.image),
            "files": [str(file) for file in one.files],
            "minutiae": one.minutiae,
            "quality": None if one.quality is None else one.quality.as_dict(),
        }
        for one in done
    ]
    return json.dumps({"templates": templates, "failures": list(map(str, failures))}, indent=2)


def _write(template: Template, stem: Path, file_format: str) -> tuple[Path, ...]:
    """Write a template under `stem`; say what its format could not hold; return the files."""
    from fpmatch.formats.files import save_template

    files = []
    for name in FORMATS[file_format]:
        path = stem.parent / f"{stem.name}{codec_of_name(name).suffixes[0]}"
        files.append(path)
        notes = save_template(path, template, file_format=name)
        for note in notes if file_format not in OWN_FORMATS else ():
            click.echo(f"fpmatch: note: {path}: {note}", err=True)
    return tuple(files)


def _refuse_shared_names(images: Sequence[Path]) -> None:
    """Raise OutputError where two images would write the same file (on any file system)."""
    by_name: dict[str, list[Path]] = defaultdict(list)
    for image in images:
        by_name[image.stem.casefold()].append(image)
    for first, *others in by_name.values():
        if others:
            raise OutputError(
                f"{first} and {others[0]} would both be written as {first.stem}; "
                "give them folders of their own"
            )


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made ({error.strerror or error})") from error


def _no_progress(images: Sequence[Path]) -> bool:
    return len(images) < 2 or not sys.stderr.isatty()
