"""`fpmatch explain`: the steps of the method on two prints or point sets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click
from click.core import ParameterSource

from fpmatch.base.parameters import read_parameters, with_parameters
from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, say_notes_on, show_line
from fpmatch.cli.options import PRINT, compare_files, output_option, pair_options
from fpmatch.errors import PointSetError
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher, split_name

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.lab.explain.steps import Step
    from fpmatch.prints.pair import ComparedPair

PAPER: Final = "paper"


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  fpmatch explain probe.tif reference.tif -o out
  fpmatch explain probe.tif reference.tif -o out --pair 7
  fpmatch explain probe.tif reference.tif -o out --matcher paper
  fpmatch explain stars.csv catalogue.csv -o out

Exit status: 0 when the page is written, whatever the decision; 2 on bad input.
""",
)
@click.argument("probe", type=PRINT)
@click.argument("reference", type=PRINT)
@pair_options
@output_option(metavar="FOLDER", help="Folder of the page; a new one, or of an earlier page.")
@click.option(
    "--pair",
    "number",
    type=int,
    metavar="N",
    help="Pair whose ring is shown, by its number in the pictures.  [default: one that is easy to "
    "read]",
)
@click.pass_context
def explain(ctx: click.Context, /, output: Path, number: int | None, **values: Any) -> None:
    """Show each step of the method on PROBE and REFERENCE, with what the matcher computes.

    Both are prints, as images or templates, or both are files of points, a row x,y each. FOLDER
    gets index.html, with a picture, a sentence and an equation a step; the pictures, as SVG; and
    numbers.json, with every number in them. The default matcher's steps are shown, or with
    --matcher paper the paper's, which are the only ones for points.
    """
    from fpmatch.base.output import check_writable
    from fpmatch.lab.explain.page import PAGE, write_page
    from fpmatch.lab.explain.steps import ExplainError
    from fpmatch.prints.report import IDENTITY, as_rows, outcome, verdict

    check_writable(output / PAGE)
    sides = [values["probe"], values["reference"]]
    sets = [_points_of(path, values) for path in sides]
    points = [one for one in sets if one is not None]
    if len(points) == 1:
        table, print_ = sides if sets[1] is None else sides[::-1]
        raise ExplainError(f"{table}: points, which cannot be compared with the print {print_}")
    chosen, facts = values["matcher"], []
    plain = split_name(chosen)[0]
    if points:
        given = ctx.get_parameter_source("matcher") != ParameterSource.DEFAULT
        if given and plain != PAPER:
            raise ExplainError(f"points are explained by --matcher {PAPER} alone, not {chosen}")
        chosen = values["matcher"] = chosen if given else PAPER
        steps, numbers = _points(values, [*zip(map(str, sides), points, strict=True)], number)
        result = verdict(numbers["match"])
    else:
        if plain not in {DEFAULT_MATCHER, PAPER}:
            raise ExplainError(f"only {DEFAULT_MATCHER} and {PAPER} are explained, not {chosen}")
        pair = compare_files(values)
        say_notes_on((pair.probe, pair.reference))
        if pair.verification.identical is not None:
            say_note(IDENTITY[pair.verification.identical])
        steps, numbers = _prints(pair, values, number)
        result = outcome(pair.verification)
        facts = as_rows(pair.verification, pair.quality)
        numbers = {"result": pair.as_dict(), **numbers}
    title = f"{sides[0].name} and {sides[1].name}, step by step"
    facts = [("Matcher", chosen), *facts]
    write_page(output, title, result, facts, steps, {"matcher": chosen, **numbers})
    show_line(f"{result}, {len(steps)} steps: {output / PAGE}")


def _prints(
    pair: ComparedPair, values: dict[str, Any], number: int | None
) -> tuple[list[Step], dict[str, Any]]:
    """Return steps and numbers of two prints."""
    matcher: Any = get_matcher(values["matcher"])
    if split_name(matcher.name)[0] == DEFAULT_MATCHER:
        from fpmatch.lab.explain.default_steps import explain_prints

        return explain_prints(pair, matcher.parameters, number)
    from fpmatch.lab.explain.paper import PaperMethod
    from fpmatch.lab.explain.paper_steps import explain_points
    from fpmatch.lab.explain.shared import transform_step

    steps, numbers = explain_points(PaperMethod.of_prints(pair, matcher), number)
    return [*steps, transform_step(pair)], numbers


def _points(
    values: dict[str, Any], sets: list[tuple[str, Any]], number: int | None
) -> tuple[list[Step], dict[str, Any]]:
    """Return steps and numbers of two point sets."""
    from fpmatch.lab.explain.paper import PaperMethod
    from fpmatch.lab.explain.paper_steps import explain_points
    from fpmatch.pointset.paper.matcher import UnitCircleParameters

    matcher: Any = get_matcher(values["matcher"])
    _, stated = split_name(values["matcher"])
    given = read_parameters(stated, matcher.name) if stated else {}
    given.pop("rho", None)
    parameters = with_parameters(UnitCircleParameters(), given, matcher.name)
    return explain_points(PaperMethod.of_sets(sets, parameters, matcher.parameters.rho), number)


def _points_of(path: Path, values: dict[str, Any]) -> NDArray[np.float64] | None:
    """Return the points of a file, None of a file that begins as an image or a template."""
    from fpmatch.base.npy import is_npy
    from fpmatch.base.parsing import read_head
    from fpmatch.lab.points.points_csv import load_points
    from fpmatch.prints.reading import content_of

    head = read_head(path)
    table = is_npy(head)  # of points by two columns, else of minutiae
    if values["raw"] or not head or (content_of(head) and not table):
        return None
    try:
        return load_points(path)
    except PointSetError as error:
        if table:
            return None
        why = str(error).removeprefix(str(path)).lstrip(",: ")
        kinds = "an image, a template or a table of points"
        raise PointSetError(f"{path}: not {kinds} ({why})") from error
