#!/usr/bin/env python3
"""Measure whether stated false match rates hold for fragments, and for templates made to match.

    .venv/bin/python benchmarks/wolves.py DIR... [--json FILE] [--markdown FILE] [--keep FOLDER]

Each DIR is an FVC-style database. Templates of these kinds are compared with the whole prints of
all other fingers, with their ridges and on their minutiae alone:

- whole prints: the prints as they are;
- fragments: 2 to 12 neighbouring minutiae of a print, with the ridges around them or without;
- crops: squares of 48 to 200 pixels at 500 dpi at random places of the images, extracted anew, of
  those that show a minutia;
- random minutiae, 2 to 12 in a small square, and templates of 100 to 250 minutiae: grids, clusters
  of coincident or nearly coincident minutiae, fans of lines; without ridges, or with drawn stripes
  or arches of any period;
- wolves: templates and images found by hill climbing, to match as many as possible of the prints of
  every other finger; measured on the prints of the others.

For each kind and size are printed the number of templates and of comparisons, the share of them at
a score of 20, 30 and 40 or more, that share over the stated one, the highest score, and the share
of unseen prints that the worst template matches at 40: the one that matches the most prints of
every other finger, measured on the prints of the others. The shares are to be at most twice the
stated ones (nothing is stated of wolves that were searched for), and no template is to match more
than 1 % of the unseen prints; "!" marks what is beyond. The exit status is 0 if all keep that, 1 if
not, 2 for bad input.

``--json`` writes what `scripts/make_accuracy_tables --wolves` reads; ``--keep`` writes the worst
template of every row that matches any unseen print. With ``--steps`` the search is the same for the
same prints and seed.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click
import cv2
from wolf_candidates import search_spaces
from wolf_probes import groups
from wolf_scores import FORMS, Prints, References, measured
from wolf_search import Budget, searched_rows

from fpmatch.errors import DatasetError, FpmatchError
from fpmatch.evaluation.extraction import extract_datasets
from fpmatch.evaluation.run import load_datasets
from fpmatch.formats.files import save_template
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.output import atomic_write_bytes, check_writable
from fpmatch.text_table import text_table
from research.synthetic_sets import make_synthetic_sets
from research.wolf_table import factors_kept, format_wolves, share_kept, wolf_cells

if TYPE_CHECKING:
    from collections.abc import Sequence

    from wolf_scores import Row

FINGERS = 30
FIRST_SEED = 641  # beside those of what is learned from


def prints_of(folders: Sequence[Path], workers: int | None) -> Prints:
    """Return the prints of some databases; refuse those that leave nothing to compare with."""
    prints = Prints.of(extract_datasets(load_datasets(folders), workers=workers))
    if not prints.searched.any() or prints.searched.all():
        raise DatasetError("the databases have too few fingers with a template: two at least")
    return prints


def measure(options: argparse.Namespace, folders: Sequence[Path]) -> list[Row]:
    """Return the rows of all kinds."""
    prints = prints_of(folders, options.workers)
    references = {form: References.of(prints, form) for form in FORMS}
    rows = []
    planned = [
        one
        for one in groups(prints, options.templates, options.seed)
        if not options.kind or one.kind in options.kind
    ]
    with click.progressbar(
        planned, label="templates", file=sys.stderr, hidden=not sys.stderr.isatty()
    ) as bar:
        for group in bar:
            probes = group.make()
            for form, compared in references.items():
                forms = (group.form, form)
                rows.append(
                    measured(
                        group.kind, group.size, probes, forms, compared, workers=options.workers
                    )
                )
    planned_searches = [
        one
        for one in search_spaces(prints.take(prints.searched))
        if not options.kind or one.kind in options.kind
    ]
    with click.progressbar(
        planned_searches, label="wolves", file=sys.stderr, hidden=not sys.stderr.isatty()
    ) as bar:
        rows += searched_rows(
            planned_searches,
            prints,
            references,
            Budget(options.search_seconds, options.steps),
            options.seed,
            workers=options.workers,
            finished=lambda _: bar.update(1),
        )
    return rows


def keep(rows: Sequence[Row], folder: Path) -> None:
    """Write the worst template of every row that matches unseen prints, and a composed image."""
    folder.mkdir(parents=True, exist_ok=True)
    for row in rows:
        if row.worst is not None and row.worst_share > 0.0:
            words = (row.kind, str(row.size), row.probes, "against", row.references)
            name = "-".join(words).replace(" ", "-")
            save_template(folder / f"{name}.json", row.worst.template)
            if row.worst.pixels is not None:
                _, png = cv2.imencode(".png", row.worst.pixels)
                atomic_write_bytes(folder / f"{name}.png", png.tobytes())


def main() -> int:
    """Run the script; return its exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", metavar="DIR", nargs="*", type=Path, help="a database")
    parser.add_argument("--synthetic", action="store_true", help="eight synthetic ones as well")
    parser.add_argument("--prints", type=Path, help="keep the synthetic prints in this folder")
    parser.add_argument(
        "--templates", type=int, default=200, help="of each kind and size (default: %(default)s)"
    )
    parser.add_argument(
        "--kind", action="append", help="these templates only (repeatable; default: all)"
    )
    parser.add_argument(
        "--search-seconds", type=float, default=20.0, help="of each search (default: %(default)s)"
    )
    parser.add_argument("--steps", type=int, help="of each search, instead of seconds")
    parser.add_argument("--seed", type=int, default=0, help="(default: %(default)s)")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--markdown", type=Path, help="write the table to this file")
    parser.add_argument("--keep", type=Path, help="write the worst templates to this folder")
    parser.add_argument("--workers", type=int, help="processes to use (default: one a core)")
    options = parser.parse_args()
    try:
        for target in filter(None, (options.json, options.markdown)):
            check_writable(target)
        with tempfile.TemporaryDirectory() as temporary:
            folders = list(options.folders)
            if options.synthetic:
                folders += make_synthetic_sets(
                    options.prints or Path(temporary),
                    fingers=FINGERS,
                    first_seed=FIRST_SEED,
                    workers=options.workers,
                )
            rows = measure(options, folders)
        found = [row.as_json() for row in rows]
        print(text_table(wolf_cells(found)))
        if options.json:
            document = {
                "matcher": MATCHER.name,
                "seed": options.seed,
                "templates": options.templates,
                "search_seconds": None if options.steps is not None else options.search_seconds,
                "search_steps": options.steps,
                "rows": found,
            }
            atomic_write_bytes(options.json, f"{json.dumps(document, indent=1)}\n".encode())
        if options.markdown:
            atomic_write_bytes(options.markdown, f"{format_wolves(found)}\n".encode())
        if options.keep:
            keep(rows, options.keep)
    except FpmatchError as error:
        print(f"wolves: {error}", file=sys.stderr)
        return 2
    return 0 if all(factors_kept(row) and share_kept(row) for row in found) else 1


if __name__ == "__main__":
    sys.exit(main())
