"""`fpmatch extract`: templates of many images."""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from fpmatch.cli.raw import raw_option
from fpmatch.cli.reading import read
from fpmatch.cli.resolution import ResolutionChoice
from fpmatch.errors import FpmatchError, OutputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.image.raw import RawSize
    from fpmatch.image.read import GreyImage

SUFFIXES: Final = {"json": (".json",), "csv": (".csv",), "both": (".json", ".csv")}


@click.command(
    epilog="""\b
Examples:
  fpmatch extract print.tif -o templates
  fpmatch extract prints/*.tif -o templates --format json --dpi 569

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
    type=click.Choice(list(SUFFIXES)),
    default="both",
    show_default=True,
    help="JSON keeps everything; CSV the minutiae, for eyes and spreadsheets.",
)
@click.option("--dpi", type=float, help="Resolution of all the images, in dots per inch.")
@raw_option
@click.pass_context
def extract(
    ctx: click.Context,
    /,
    images: tuple[Path, ...],
    output: Path,
    file_format: str,
    dpi: float | None,
    raw: tuple[RawSize, ...],
) -> None:
    """Write the template of each IMAGE into a folder, under the image's name.

    Positions are pixels of the image, from the top left, y down; directions follow
    ISO/IEC 19794-2, counter-clockwise from the x axis.
    """
    if dpi is not None:
        from fpmatch.minutiae import check_dpi

        check_dpi(dpi)
    _refuse_shared_names(images)
    _make_folder(output)
    resolution = ResolutionChoice()
    failures: list[FpmatchError] = []
    minutiae = 0
    with click.progressbar(
        images, label="extracting", file=sys.stderr, hidden=_no_progress(images)
    ) as bar:
        for image in bar:
            try:
                minutiae += _extract_one(
                    read(image, raw), output / image.stem, SUFFIXES[file_format], resolution, dpi
                )
            except OutputError:
                raise
            except FpmatchError as error:
                failures.append(error)
    done = len(images) - len(failures)
    click.echo(f"{done} of {len(images)} templates, {minutiae} minutiae: {output}")
    for failure in failures:
        click.echo(f"fpmatch: error: {failure}", err=True)
    ctx.exit(2 if failures else 0)


def _extract_one(
    picture: GreyImage,
    stem: Path,
    suffixes: Sequence[str],
    resolution: ResolutionChoice,
    dpi: float | None,
) -> int:
    """Write the template of one image under `stem`; return the number of its minutiae."""
    from fpmatch.formats.files import save_template
    from fpmatch.image.extract import extract as extract_template

    template = extract_template(picture, resolution.of(picture, dpi))
    for suffix in suffixes:
        save_template(stem.parent / f"{stem.name}{suffix}", template)
    return len(template.minutiae)


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
