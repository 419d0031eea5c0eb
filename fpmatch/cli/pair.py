"""Two prints as `verify` and `overlay` read and compare them."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from fpmatch.cli.notes import say_note, say_notes

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from fpmatch.pair import ComparedPair, PairOptions
    from fpmatch.reading import GivenPrint


def compare_files(values: Mapping[str, Any]) -> ComparedPair:
    """Read and compare the prints of a command line, see `fpmatch.cli.options.pair_options`.

    Raises
    ------
    FpmatchError
        If a print cannot be read or used, or an option is out of its range.
    """
    from fpmatch.pair import compare_pair
    from fpmatch.pointset.unit_circle.matcher import DEFAULT_AREA_TOLERANCE

    options = pair_options_of(values)
    compared = compare_pair(open_side(values, "probe"), open_side(values, "reference"), options)
    used = options.area_tolerance
    if used not in {None, DEFAULT_AREA_TOLERANCE} and options.calibration is None:
        say_note(
            f"the score was calibrated at an area tolerance of {DEFAULT_AREA_TOLERANCE:g}, "
            f"not {used:g}"
        )
    return compared


def pair_options_of(values: Mapping[str, Any]) -> PairOptions:
    """Return the options of a command line that are about the comparison."""
    from fpmatch.pair import PairOptions

    return PairOptions(**{field.name: values[field.name] for field in fields(PairOptions)})


def open_side(values: Mapping[str, Any], side: str) -> GivenPrint:
    """Read the print of one side, "probe" or "reference"."""
    from fpmatch.reading import PrintReader, make_given_print

    path, dpi = values[side], values[f"{side}_dpi"]
    dpi = values["dpi"] if dpi is None else dpi
    found = PrintReader(values["raw"], quiet=True)(path, polarity=values["polarity"], dpi=dpi)
    return make_given_print(found, str(path), dpi=dpi, enhance=values["enhance"])


def say_notes_on(prints: Iterable[GivenPrint], *, resolution: bool = False) -> None:
    """Print the notes on prints; with `resolution`, also where the ridges contradict theirs."""
    from fpmatch.image.quality.print_quality import WRONG_RESOLUTION
    from fpmatch.reading import group_by_note

    noted: dict[str, tuple[str, ...]] = {}
    for given in prints:
        reasons = given.quality.reasons if resolution and given.quality is not None else ()
        wrong = [str(reason) for reason in reasons if reason.code == WRONG_RESOLUTION]
        noted[given.name] = (*given.notes, *wrong)
    say_notes(group_by_note(noted.items()))
