"""The command ``promises``."""

from __future__ import annotations

import tempfile
from dataclasses import asdict
from pathlib import Path
from random import Random

import click

from fpmatch.printable import text_table
from research.commands import ROOT, Command, json_file, write_json
from research.promises import audits, damage, files, network, thieves
from research.promises.attack import ATTACKS, NOT_TRIED, Outcome, attempt
from research.promises.program import Place
from research.tables.pages import read_json

MODULES = (files, network, damage, thieves, audits)  # they register their attacks


def promises() -> list[str]:
    """Return the beginnings of the promises, in the order of the page."""
    page = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
    places = {promise: page.find(f"\n| {promise}") for promise in (*ATTACKS, *NOT_TRIED)}
    return sorted((promise for promise in places if places[promise] >= 0), key=places.__getitem__)


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  python -m research promises
  python -m research promises --only killed_enrolments --seed 7
""",
)
@click.option(
    "--only", "names", multiple=True, metavar="NAME", help="Only this attack (repeatable)."
)
@click.option("--seed", default=1, show_default=True, help="Of the random numbers.")
@json_file
@click.pass_context
def command(
    context: click.Context, names: tuple[str, ...], seed: int, json_file: Path | None
) -> None:
    """Attack each promise of docs/security.md from outside.

    Attacks use the commands, HTTP, the public Python names and the files of fpmatch. The exit
    status is 1 where a promise is broken. With --only, the file of --json keeps the outcomes of
    the other attacks.
    """
    known = [function.__name__ for function in ATTACKS.values()]
    if unknown := set(names) - set(known):
        raise click.BadParameter(f"{min(unknown)!r} is none of {', '.join(known)}")
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        for promise in promises():
            name = ATTACKS[promise].__name__ if promise in ATTACKS else ""
            if names and name and name not in names:
                continue
            if not name:
                outcomes.append(Outcome(promise, NOT_TRIED[promise], ""))
                continue
            place = Place(Path(folder, name, "here"), Random(f"{seed}{name}"), Path(folder))
            place.folder.mkdir(parents=True)
            outcomes.append(attempt(promise, ATTACKS[promise], place))
            click.echo("  ".join(_cells(outcomes[-1])), err=True)
    rows = [["promise", "attack", "tries", "outcome"], *map(_cells, outcomes)]
    click.echo(text_table(rows, left=2))
    if json_file:
        known = read_json(json_file) if names and json_file.exists() else []
        records = {one["promise"]: one for one in (*known, *map(asdict, outcomes))}
        write_json(json_file, [records[one] for one in promises() if one in records])
    context.exit(1 if any(outcome.broken for outcome in outcomes) else 0)


def _cells(one: Outcome) -> list[str]:
    broken = f"broken {one.broken} times: {one.example}" if one.broken else "kept"
    name = f"{one.name} ({one.seconds:.0f} s)" if one.name else "-"
    return [one.promise, name, str(one.tries), broken if one.name else f"not tried: {one.attack}"]
