"""The command of ``python -m research measure wolves``."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any, Final

import click
import cv2

from fpmatch.base.output import atomic_write_bytes
from fpmatch.errors import DatasetError
from fpmatch.formats.files import save_template
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.commands import PATH, Command, json_file, synthetic_folder, workers, write_json
from research.databases import TEST_SEED, extract_folders, extract_synthetic_sets
from research.wolves.candidates import search_spaces
from research.wolves.probes import groups
from research.wolves.scores import FORMS, Prints, References, measured
from research.wolves.search import Budget, searched_rows
from research.wolves.table import factors_kept, format_wolves, share_kept

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from research.wolves.scores import Row

SYNTHETIC: Final = "synthetic wolf"
MADE: Final = 24_000  # synthetic fingers that these are searched for, and measured on
MADE_SEED: Final = 642  # of which nothing was trained


@click.command(
    cls=Command,
    epilog="""\b
Templates:
- whole prints: the prints as they are;
- fragments: 2 to 12 neighbouring minutiae of a print, with the ridges around them or without;
- crops: squares of 48 to 200 pixels at 500 dpi at random places of the images, extracted again,
  of those that show a minutia;
- random minutiae, 2 to 12 in a small square, and templates of 100 to 250 minutiae: grids,
  clusters of coincident or nearly coincident minutiae, fans of lines; without ridges, or with
  drawn stripes or arches of any period;
- wolves: templates and images found by an evolutionary search (patches of prints joined; minutiae
  moved, added and dropped; ridges redrawn), to match as many as possible of the prints of every
  other finger; measured on the prints of the others. Templates are searched for in all four
  combinations of forms, on these prints and on synthetic ones made without images.
""",
)
@click.argument("folders", metavar="[DIR]...", nargs=-1, type=PATH)
@click.option("--synthetic", is_flag=True, help="Eight synthetic databases as well.")
@synthetic_folder
@click.option("--templates", default=200, show_default=True, help="Of each kind and size.")
@click.option("--kind", "kinds", multiple=True, help="Only these templates (repeatable).")
@click.option("--search-seconds", default=20.0, show_default=True, help="Of each search.")
@click.option("--steps", type=int, help="Of each search, instead of seconds.")
@click.option("--seed", default=0, show_default=True)
@json_file
@click.option("--keep", metavar="FOLDER", type=PATH, help="Write the worst templates there.")
@workers
@click.pass_context
def command(
    context: click.Context,
    folders: tuple[Path, ...],
    synthetic: bool,
    prints: Path | None,
    templates: int,
    kinds: tuple[str, ...],
    search_seconds: float,
    steps: int | None,
    seed: int,
    json_file: Path | None,
    keep: Path | None,
    workers: int | None,
) -> None:
    """Measure whether stated false match rates hold for fragments and adversarial templates.

    Each DIR is an FVC-style database. Templates of the kinds below are compared with the whole
    prints of all other fingers, with their ridges and on their minutiae alone.

    For each kind and size are printed the ratios of the shares of comparisons at a score of 20, 30
    and 40 or more to the stated shares, and the share of unseen prints that the worst template
    matches at 40: the one that matches the most prints of every other finger, measured on the
    prints of the others. The ratios should be at most 2 (of wolves 3, at 30 and 40, as far as so
    few comparisons show), and no template should match more than 1 % of the unseen prints. What is
    beyond its limit is named, and the exit status is 1.

    --json writes what ``python -m research tables accuracy --wolves`` reads; --keep writes the
    worst template of every row that matches any unseen print. With --steps the search is the same
    for the same prints and seed.
    """
    sets = extract_folders(folders, workers)
    if synthetic:
        sets += extract_synthetic_sets(TEST_SEED, prints, workers)
    budget = Budget(search_seconds, steps)
    rows = _measure(_prints_of(sets), templates, kinds, budget, seed, workers)
    found = [row.as_json() for row in rows]
    click.echo(format_wolves(found))
    beyond = [row for row in found if not (factors_kept(row) and share_kept(row))]
    for row in beyond:
        words = f"{row['kind']} {row['size']}, {row['probes']}, against {row['references']}"
        click.echo(f"beyond its limit: {words}")
    if json_file:
        document = {
            "matcher": MATCHER.name,
            "seed": seed,
            "templates": templates,
            "search_seconds": None if steps is not None else search_seconds,
            "search_steps": steps,
            "rows": found,
        }
        write_json(json_file, document)
    if keep:
        _keep(rows, keep)
    context.exit(1 if beyond else 0)


def _prints_of(sets: Sequence[ExtractedSet]) -> Prints:
    """Return the prints of some databases; refuse those that leave nothing to compare with."""
    if sets:
        prints = Prints.of(sets)
        if prints.searched.any() and not prints.searched.all():
            return prints
    raise DatasetError("the databases have too few fingers with a template: two at least")


def _measure(
    prints: Prints,
    count: int,
    kinds: tuple[str, ...],
    budget: Budget,
    seed: int,
    workers: int | None,
) -> list[Row]:
    """Return the rows of all kinds."""
    references = {form: References.of(prints, form) for form in FORMS}
    hidden = not sys.stderr.isatty()
    rows = []
    planned = [one for one in groups(prints, count, seed) if not kinds or one.kind in kinds]
    with click.progressbar(planned, label="templates", file=sys.stderr, hidden=hidden) as bar:
        for group in bar:
            probes = group.make()
            for form, compared in references.items():
                forms = (group.form, form)
                rows.append(
                    measured(group.kind, group.size, probes, forms, compared, workers=workers)
                )
    spaces = search_spaces(prints.take(prints.searched))
    searches = [one for one in spaces if not kinds or one.kind in kinds]
    with click.progressbar(searches, label="wolves", file=sys.stderr, hidden=hidden) as bar:
        options: dict[str, Any] = {"workers": workers, "finished": lambda _: bar.update(1)}
        rows += searched_rows(searches, prints, references, budget, seed, **options)
    if not kinds or SYNTHETIC in kinds:
        made = Prints.made(MADE, MADE_SEED)
        spaces = search_spaces(made.take(made.searched), SYNTHETIC, images=False)
        references = {form: References.of(made, form) for form in FORMS}
        with click.progressbar(length=4, label=SYNTHETIC, file=sys.stderr, hidden=hidden) as bar:
            rows += searched_rows(list(spaces), made, references, budget, seed, **options)
    return rows


def _keep(rows: Sequence[Row], folder: Path) -> None:
    """Write the worst template of every row that matches unseen prints, and a composed image."""
    folder.mkdir(parents=True, exist_ok=True)
    for row in rows:
        if row.worst is not None and row.worst_share > 0.0:
            words = (row.kind, str(row.size), row.probes, "against", row.references)
            name = "-".join(words).replace(" ", "-")
            save_template(folder / f"{name}.json", row.worst.template)
            if row.worst.pixels is not None:
                _, png = cv2.imencode(".png", row.worst.pixels)
                atomic_write_bytes(folder / f"{name}.png", png.tobytes(), public=True)
