"""Options that several commands share."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import load_object
from fpmatch.errors import FpmatchError, did_you_mean
from fpmatch.matching.registry import DEFAULT_MATCHER

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


# Of fpmatch.image.quality.polarity and fpmatch.image.enhancement.enhancers, which import OpenCV.
POLARITIES: Final = ("auto", "dark", "white")
ENHANCEMENTS: Final = ("learned", "filters")

FILE: Final = click.Path(path_type=Path)
_STDIN: Final = "standard-input"


class PrintFile(click.Path):
    """The file of a print; of "-", standard input, a copy that lasts as long as the command."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path of the file or of the copy."""
        if str(value) != "-" or ctx is None or ctx.resilient_parsing:
            return super().convert(value, param, ctx)
        from fpmatch.image.io import grey

        if _STDIN in ctx.meta:
            self.fail("only one print can come from standard input", param, ctx)
        if sys.stdin is None:
            self.fail("standard input is closed", param, ctx)
        ctx.meta[_STDIN] = True
        folder = ctx.find_root().with_resource(TemporaryDirectory(prefix="fpmatch-"))
        copy = Path(folder, _STDIN)
        # One byte beyond the limit, so that the reader refuses a file that is too large.
        copy.write_bytes(
            sys.stdin.buffer.read(int(grey.DEFAULT_LIMITS.max_file_megabytes * 1e6) + 1)
        )
        return copy


class Name(click.Choice[str]):
    """One of some names; the closest is suggested for another."""

    def get_invalid_choice_message(self, value: object, ctx: click.Context | None) -> str:
        """Return the message about an unknown name."""
        message = super().get_invalid_choice_message(value, ctx)
        return f"{message}{did_you_mean(str(value), self.choices)}"


def parsed_by(place: str) -> Callable[[str], Any]:
    """Return the type of a value that the method `parse` of a class reads; see `load_object`."""

    def parse(text: str) -> Any:
        try:
            return load_object(place, used_by=text).parse(text)
        except FpmatchError as error:
            raise click.BadParameter(str(error)) from error

    return parse


image_size: Final = parsed_by("fpmatch.image.io.grey:RawSize")


class FormatChoice(Name):
    """One of some names, or of the formats of other packages, which are looked for if need be."""

    def _with_plugins(self) -> Name:
        from fpmatch.base.plugins import FORMATS, plugin_names

        return Name(list(dict.fromkeys([*self.choices, *plugin_names(FORMATS)])))

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str | None:
        """Return all the names, for help texts."""
        return self._with_plugins().get_metavar(param, ctx)

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return `value`, or fail with all the names."""
        if value in self.choices:
            return value
        return self._with_plugins().convert(value, param, ctx)


file_option: Final = partial(click.option, type=FILE)
output_option: Final = partial(file_option, "-o", "--output", required=True)
PRINT: Final = PrintFile(path_type=Path, allow_dash=True)
files_argument: Final = partial(click.argument, nargs=-1, required=True, type=FILE)
_DPI: Final = click.option(
    "--dpi",
    type=float,
    help="Dots per inch of the prints.  [default: of dataset.toml beside a file, of the file, or "
    "by the ridges of its folder]",
)
_RAW: Final = click.option(
    "--raw",
    metavar="WxH",
    multiple=True,
    type=image_size,
    hidden=True,
    help="Read files of W times H pixels of 8, 4, 2 or 1 bits, without a header; may be repeated.",
)
_POLARITY: Final = click.option(
    "--polarity",
    type=click.Choice(POLARITIES),
    default=POLARITIES[0],
    hidden=True,
    help="Ridges are dark or white in the images; auto: by dataset.toml, else detected.",
)
enhance_option: Final = click.option(
    "--enhance",
    type=click.Choice(ENHANCEMENTS),
    default=ENHANCEMENTS[0],
    hidden=True,
    help="Enhancement of ridges in images: by a small neural network, or by Gabor filters.",
)
RECORD: Final = click.option(
    "--record",
    metavar="N",
    type=click.IntRange(min=1),
    hidden=True,
    help="Read this print of cards and records with several (ANSI/NIST-ITL, ISO/IEC 19794-2), from "
    "1; fingers without an image are not counted.  [default: the first]",
)
MIRROR: Final = click.option(
    "--mirror",
    is_flag=True,
    hidden=True,
    help="Exchange left and right of what is read, of sensors whose prints are mirrored; where two "
    "prints are compared, of PROBE alone.",
)
matcher_option: Final = click.option(
    "--matcher",
    metavar="NAME",
    default=DEFAULT_MATCHER,
    help="Matcher to use, perhaps with parameters, as in unit-circle:rounds=5: see fpmatch doctor "
    "--matchers.",
)
angles_option: Final = click.option(
    "--angles",
    metavar="deg|rad[,clockwise][,opposite]",
    type=parsed_by("fpmatch.formats.record:AngleConvention"),
    hidden=True,
    help="How tables of minutiae (CSV, np.savetxt, .npy) measure angles: unit; sense on screen, "
    "from +x; opposite to ISO/IEC 19794-2.  [default: by the header]",
)


def add_options(command: Callable[..., Any], options: Sequence[Any]) -> Callable[..., Any]:
    """Add options to a command, in their order."""
    for option in reversed(options):
        command = option(command)
    return command


def reading_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options about how files of prints are read: ``--dpi``, ``--polarity``, ``--raw``."""
    return add_options(command, (_DPI, _POLARITY, _RAW))


json_option: Final = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
json_array_option: Final = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON array."
)
