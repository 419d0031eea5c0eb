"""Two prints as `verify` and `explain` read and compare them."""

from __future__ import annotations

from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.options import (
    MIRROR,
    PRINT,
    RECORD,
    add_options,
    angles_option,
    enhance_option,
    file_option,
    matcher_option,
    reading_options,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fpmatch.prints.pair import ComparedPair, PairOptions
    from fpmatch.prints.reading import GivenPrint

_OPTIONS: Final = (
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


def pair_options(*, reference_required: bool = True) -> Callable[[Any], Any]:
    """Return the decorator that gives a command PROBE, REFERENCE and the comparison's options."""
    reference = click.argument("reference", type=PRINT, required=reference_required)
    return partial(add_options, options=(click.argument("probe", type=PRINT), reference, *_OPTIONS))


def compare_files(values: Mapping[str, Any]) -> ComparedPair:
    """Read and compare the prints of a command line; `values` are those of `pair_options`."""
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
