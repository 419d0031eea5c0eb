"""`fpmatch explain`: the steps of the method on two prints or point sets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click
from click.core import ParameterSource

from fpmatch.base.parameters import read_parameters, with_parameters
from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, say_notes_on, show_line
from fpmatch.cli.options import PRINT, compare_files, open_side, output_option, pair_options
from fpmatch.errors import PointSetError
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher, split_name

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.lab.explain.steps import Step

PAPER: Final = "paper"


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  fpmatch explain probe.tif reference.tif -o out
  fpmatch explain probe.tif reference.tif -o out --pair 7
  fpmatch explain probe.tif reference.tif -o out --matcher paper
  fpmatch explain probe.tif reference.tif -o out --matcher unit-circle:rounds=1
  fpmatch explain stars.csv turned.csv -o out

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
    numbers.json, with the numbers of the steps. The default matcher's steps are shown, or with
    --matcher paper the paper's, which are the only ones for points. Parameters without a
    calibration are shown without a score.
    """
    from fpmatch.base.output import check_writable
    from fpmatch.lab.explain.page import PAGE, check_folder, write_page
    from fpmatch.lab.explain.steps import ExplainError
    from fpmatch.lab.plots.style import check_matplotlib

    check_matplotlib("explain:")
    check_folder(output)
    check_writable(output / PAGE)
    sides = [values["probe"], values["reference"]]
    points = [one for path in sides if (one := _points_of(path, values)) is not None]
    if len(points) == 1:
        raise ExplainError(f"{sides[0]} and {sides[1]}: one has points, the other is a print")
    if points:
        if ctx.get_parameter_source("matcher") == ParameterSource.DEFAULT:
            values["matcher"] = PAPER
        sets = list(zip(map(str, sides), points, strict=True))
        result, facts, steps = _of_points(values["matcher"], sets, number)
        numbers: dict[str, Any] = {}
    else:
        result, facts, steps, numbers = _of_prints(values, number)
    title = f"{sides[0].name} and {sides[1].name}, step by step"
    facts = [("Matcher", values["matcher"]), *facts]
    write_page(output, title, result, facts, steps, {"matcher": values["matcher"], **numbers})
    show_line(f"{result}, {len(steps)} steps: {output / PAGE}")


def _of_prints(
    values: dict[str, Any], number: int | None
) -> tuple[str, list[tuple[str, str]], list[Step], dict[str, Any]]:
    """Return the decision on two prints, facts, steps and numbers."""
    from fpmatch.lab.explain.default import explain_prints, transform_step
    from fpmatch.lab.explain.paper import PaperMethod, explain_points
    from fpmatch.lab.explain.steps import ExplainError
    from fpmatch.matching.calibration import is_calibrated
    from fpmatch.prints.report import IDENTITY, as_rows, outcome

    matcher: Any = get_matcher(values["matcher"])
    plain = split_name(matcher.name)[0]
    if plain not in {DEFAULT_MATCHER, PAPER}:
        only = f"only {DEFAULT_MATCHER} and {PAPER} are explained"
        raise ExplainError(f"{only}, not {values['matcher']}")
    if plain == DEFAULT_MATCHER and not (values["calibration"] or is_calibrated(matcher.name)):
        both = open_side(values, "probe"), open_side(values, "reference")
        say_notes_on(both)
        reason = "none: these parameters have no calibration; see fpmatch calibrate"
        steps = explain_prints(*both, matcher.parameters, number, None)
        return "NO SCORE", [("Score", reason)], steps, {"result": None}
    pair = compare_files(values)
    both = pair.probe, pair.reference
    say_notes_on(both)
    if pair.verification.identical is not None:
        say_note(IDENTITY[pair.verification.identical])
    if plain == DEFAULT_MATCHER:
        steps = explain_prints(*both, matcher.parameters, number, pair)
    else:
        steps = explain_points(PaperMethod.of_prints(*both, matcher), number)
        steps.append(transform_step(pair))
    facts = as_rows(pair.verification, pair.quality)
    return outcome(pair.verification), facts, steps, {"result": pair.as_dict()}


def _of_points(
    chosen: str, sets: list[tuple[str, Any]], number: int | None
) -> tuple[str, list[tuple[str, str]], list[Step]]:
    """Return the paper's decision on two point sets, facts and steps."""
    from fpmatch.lab.explain.paper import PaperMethod, explain_points
    from fpmatch.lab.explain.steps import ExplainError
    from fpmatch.lab.points.match import match_points
    from fpmatch.pointset.paper.matcher import UnitCircleParameters
    from fpmatch.prints.report import verdict

    name, stated = split_name(chosen)
    if name != PAPER:
        raise ExplainError(f"points are explained by --matcher {PAPER} alone, not {chosen}")
    matcher: Any = get_matcher(chosen)
    given = read_parameters(stated, matcher.name) if stated else {}
    given.pop("rho", None)
    parameters = with_parameters(UnitCircleParameters(), given, matcher.name)
    method = PaperMethod.of_sets(sets, parameters, matcher.parameters.rho)
    steps = explain_points(method, number)
    try:
        by_default = repr(match_points(sets[0][1], sets[1][1]))
    except PointSetError as error:
        by_default = str(error)
    return verdict(method.matches), [("By triangles", by_default)], steps


def _points_of(path: Path, values: dict[str, Any]) -> NDArray[np.float64] | None:
    """Return the points of a file, None of a file that begins as an image or a template."""
    from fpmatch.base.npy import is_npy
    from fpmatch.base.parsing import read_head
    from fpmatch.lab.points.points_csv import load_points
    from fpmatch.prints.reading import content_of

    head = read_head(path)
    if values["raw"] or not head or (content_of(head) and not is_npy(head)):
        return None
    try:
        return load_points(path)
    except PointSetError:
        if is_npy(head):  # of minutiae
            return None
        raise
