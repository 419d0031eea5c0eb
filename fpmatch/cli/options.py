"""Options that several commands share, and how `verify` and `explain` compare two prints."""

from __future__ import annotations

import sys
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import load_object
from fpmatch.errors import FpmatchError
from fpmatch.matching.registry import DEFAULT_MATCHER

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from fpmatch.prints.pair import ComparedPair, PairOptions
    from fpmatch.prints.reading import GivenPrint


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
        from tempfile import TemporaryDirectory

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


@dataclass(frozen=True)
class Parsed(click.ParamType[Any]):
    """A value that the method `parse` of the class at a place reads; see `load_object`."""

    place: str
    name: str = "text"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the value."""
        try:
            return load_object(self.place, used_by=value).parse(value)
        except FpmatchError as error:
            self.fail(str(error), param, ctx)


image_size: Final = Parsed("fpmatch.image.io.grey:RawSize")


class FormatChoice(click.Choice[str]):
    """One of some names, or of the formats of other packages, which are looked for if need be."""

    def _with_plugins(self) -> click.Choice[str]:
        from fpmatch.base.plugins import FORMATS, plugin_names

        return click.Choice(list(dict.fromkeys([*self.choices, *plugin_names(FORMATS)])))

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str | None:
        """Return all the names, for help texts."""
        return self._with_plugins().get_metavar(param, ctx)

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return `value`, or fail with all the names."""
        return value if value in self.choices else self._with_plugins().convert(value, param, ctx)


file_option: Final = partial(click.option, type=FILE)
output_option: Final = partial(file_option, "-o", "--output", required=True)
PRINT: Final = PrintFile(path_type=Path, allow_dash=True)
files_argument: Final = partial(click.argument, nargs=-1, required=True, type=FILE)
dpi_option: Final = click.option(
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
    type=Parsed("fpmatch.formats.record:AngleConvention"),
    hidden=True,
    help="How tables of minutiae (CSV, np.savetxt, .npy) measure angles: unit; sense on screen, "
    "from +x; opposite to ISO/IEC 19794-2.  [default: by the header]",
)


def add_options(command: Callable[..., Any], options: Sequence[Any]) -> Callable[..., Any]:
    """Add options to a command, in their order."""
    for option in reversed(options):
        command = option(command)
    return command


reading_options: Final = partial(add_options, options=(dpi_option, _POLARITY, _RAW))
json_option: Final = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
json_array_option: Final = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON array."
)
_OF_PAIRS: Final = (
    reading_options,
    RECORD,
    MIRROR,
    click.option("--probe-dpi", type=float, hidden=True, help="Resolution of the probe."),
    click.option("--reference-dpi", type=float, hidden=True, help="Resolution of the reference."),
    click.option(
        "--fmr",
        type=float,
        metavar="RATE",
        help="Decide at this false match rate: 0.0001 accepts one impostor in 10,000.  [default: "
        "0.0001; with --matcher paper, its parameter rho decides]",
    ),
    click.option(
        "--threshold", type=float, metavar="SCORE", help="Decide at this score, 0 to 100."
    ),
    matcher_option,
    file_option(
        "--calibration",
        metavar="FILE",
        hidden=True,
        help="Score as fitted by fpmatch calibrate.  [default: that of the package]",
    ),
    enhance_option,
    angles_option,
)
pair_options: Final = partial(add_options, options=_OF_PAIRS)


def compare_files(values: Mapping[str, Any]) -> ComparedPair:
    """Read and compare the prints of a command line, whose `pair_options` have these values."""
    from fpmatch.prints.pair import compare_pair

    options = pair_options_of(values)
    return compare_pair(open_side(values, "probe"), open_side(values, "reference"), options)


def pair_options_of(values: Mapping[str, Any]) -> PairOptions:
    """Return the options of a command line that are about the comparison."""
    from fpmatch.prints.pair import PairOptions

    return PairOptions(**{field.name: values[field.name] for field in fields(PairOptions)})


def open_side(values: Mapping[str, Any], side: str) -> GivenPrint:
    """Read the print of one side, "probe" or "reference"."""
    from fpmatch.prints.reading import PrintReader, read_given_print

    dpi = values[f"{side}_dpi"]
    how = {"polarity": values["polarity"], "dpi": values["dpi"] if dpi is None else dpi}
    reader = PrintReader(
        values["raw"],
        quiet=True,
        angles=values["angles"],
        record=values["record"],
        mirror=values["mirror"] and side == "probe",
    )
    return read_given_print(values[side], reader, **how, enhance=values["enhance"])
