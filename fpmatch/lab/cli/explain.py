"""`fpmatch explain`: a page of the steps of the method on two prints or point sets."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

import click
from click.core import ParameterSource

from fpmatch.base.parameters import read_parameters, with_parameters
from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, say_notes_on, show_line
from fpmatch.cli.options import PRINT, compare_files, open_side, output_option, pair_options
from fpmatch.errors import FpmatchError, OutputError, PointSetError
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher, split_name
from fpmatch.printable import json_text, printable, printable_lines

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.lab.explain.pictures import Step

    Floats = NDArray[np.float64]
    Explained = tuple[str, list[tuple[str, str]], list[Step], dict[str, Any]]

PAPER: Final = "paper"
PAGE, NUMBERS = "index.html", "numbers.json"
OWN_FILE: Final = re.compile(r"index\.html|numbers\.json|\d\d_[a-z_]+\.svg")


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  fpmatch explain probe.tif reference.tif -o out
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
@click.pass_context
def explain(ctx: click.Context, /, output: Path, **values: Any) -> None:
    """Show each step of the method on PROBE and REFERENCE, with what the matcher computes.

    Both are prints, as images or templates, or both are files of points, a row x,y each. FOLDER
    gets index.html, with a sentence, an equation and mostly a picture a step; the pictures, as SVG;
    and numbers.json, with the numbers of the steps. The default matcher's steps are shown, or with
    --matcher paper the paper's, which are the only ones for points. Parameters without a
    calibration are shown without a score.
    """
    from fpmatch.base.output import check_writable
    from fpmatch.lab.plots.style import check_matplotlib

    check_matplotlib("explain:")
    for other in sorted(path.name for path in output.iterdir()) if output.is_dir() else ():
        if not OWN_FILE.fullmatch(other):
            raise OutputError(f"{output}: holds another file, {other}: name a new folder")
    check_writable(output / PAGE)
    sides = values["probe"], values["reference"]
    points = [one for path in sides if (one := _points_of(path, values)) is not None]
    if len(points) == 1:
        raise FpmatchError(f"{sides[0]} and {sides[1]}: one has points, the other is a print")
    if points and ctx.get_parameter_source("matcher") == ParameterSource.DEFAULT:
        values["matcher"] = PAPER
    name = values["matcher"]
    result, facts, steps, numbers = (
        _of_points(name, sides, points) if points else _of_prints(name, values)
    )
    facts = [("Matcher", name), *facts]
    title = f"{sides[0].name} and {sides[1].name}, step by step"
    write_page(output, title, (result, facts, steps, {"matcher": name, **numbers}))
    show_line(f"{result}, {len(steps)} steps: {output / PAGE}")


def _of_prints(name: str, values: dict[str, Any]) -> Explained:
    """Explain two prints."""
    from fpmatch.lab.explain.default import DefaultMethod, explain_prints
    from fpmatch.lab.explain.paper import PaperMethod, explain_points
    from fpmatch.matching.calibration import is_calibrated
    from fpmatch.prints.report import IDENTITY, as_rows, outcome

    matcher: Any = get_matcher(name)
    plain = split_name(matcher.name)[0]
    if plain not in {DEFAULT_MATCHER, PAPER}:
        raise FpmatchError(f"only {DEFAULT_MATCHER} and {PAPER} are explained, not {name}")
    if plain == DEFAULT_MATCHER and not (values["calibration"] or is_calibrated(matcher.name)):
        pair, both = None, (open_side(values, "probe"), open_side(values, "reference"))
    else:
        pair = compare_files(values)
        both = pair.probe, pair.reference
    say_notes_on(both)
    if plain == PAPER:
        steps = explain_points(PaperMethod.of_prints(*both, matcher))
    else:
        steps = explain_prints(DefaultMethod.of(*both, matcher.parameters), pair)
    if pair is None:
        reason = "none: these parameters have no calibration; see fpmatch calibrate"
        return "NO SCORE", [("Score", reason)], steps, {"result": None}
    if pair.verification.identical is not None:
        say_note(IDENTITY[pair.verification.identical])
    facts = as_rows(pair.verification, pair.quality)
    return outcome(pair.verification), facts, steps, {"result": pair.as_dict()}


def _of_points(chosen: str, sides: tuple[Path, Path], points: list[Floats]) -> Explained:
    """Explain two point sets by the paper's method."""
    from fpmatch.lab.explain.paper import PaperMethod, explain_points
    from fpmatch.lab.points.match import match_points
    from fpmatch.pointset.paper.matcher import UnitCircleParameters
    from fpmatch.prints.report import verdict

    name, stated = split_name(chosen)
    if name != PAPER:
        raise FpmatchError(f"points are explained by --matcher {PAPER} alone, not {chosen}")
    matcher: Any = get_matcher(chosen)
    given = read_parameters(stated, matcher.name) if stated else {}
    given.pop("rho", None)
    parameters = with_parameters(UnitCircleParameters(), given, matcher.name)
    sets = (str(sides[0]), points[0]), (str(sides[1]), points[1])
    method = PaperMethod.of_sets(sets, parameters, matcher.parameters.rho)
    try:
        default = match_points(*points)
        by_default = "; ".join(map(": ".join, default.facts())) or default.reason
    except PointSetError as error:
        by_default = str(error)
    steps = explain_points(method)
    return verdict(steps[-1].numbers["match"]), [("By triangles", by_default)], steps, {}


def _points_of(path: Path, values: dict[str, Any]) -> Floats | None:
    """Return the points of a table, None of a file that begins as an image or a template."""
    from fpmatch.base.parsing import read_head
    from fpmatch.lab.points.points_csv import load_table
    from fpmatch.prints.reading import content_of

    head = read_head(path)
    return None if values["raw"] or not head or content_of(head) else load_table(path).points


def write_page(folder: Path, title: str, explained: Explained) -> None:
    """Write pictures, numbers and page, in this order; they replace an earlier page."""
    from fpmatch._version import __version__
    from fpmatch.base.folders import write_files
    from fpmatch.base.html import page_templates
    from fpmatch.lab.plots.style import number

    result, facts, steps, numbers = explained
    names = [f"{n:02d}_{step.name}.svg" * bool(step.picture) for n, step in enumerate(steps, 1)]
    files = {name: step.picture for name, step in zip(names, steps, strict=True) if step.picture}
    numbers |= {step.name: step.numbers for step in steps if step.numbers}
    files[NUMBERS] = (json_text(numbers, indent=None) + "\n").encode()
    templates = page_templates("fpmatch.lab.explain")
    templates.filters["number"] = number
    shown = list(zip(steps, names, strict=True))
    html = templates.get_template("page.html.j2").render(
        title=printable(title), verdict=result, facts=facts, steps=shown, version=__version__
    )
    files[PAGE] = printable_lines(html.lstrip()).encode()
    write_files(files, folder)
    for path in folder.iterdir():
        if path.name not in files and OWN_FILE.fullmatch(path.name):
            path.unlink()
