"""The option that names several matchers."""

from __future__ import annotations

from typing import Final

import click

from fpmatch.base.plugins import MATCHERS, load_plugins
from fpmatch.cli.notes import say_note
from fpmatch.matching.registry import DEFAULT_MATCHER, OWN_MATCHERS, matcher_names

matchers_option: Final = click.option(
    "--matcher",
    "matchers",
    multiple=True,
    default=[DEFAULT_MATCHER],
    metavar="NAME",
    help="Matcher of fpmatch doctor --matchers; repeatable, or all.",
)


def chosen_matchers(names: tuple[str, ...]) -> list[str]:
    """Return the requested matchers, each once; "all" means every matcher that can be loaded."""
    known = matcher_names()
    if "all" in names:
        for name, why in load_plugins(MATCHERS)[1].items():
            if name not in OWN_MATCHERS:
                known.remove(name)
                say_note(f"matcher {name} is left out: {why}")
    every = [name for given in names for name in (known if given == "all" else [given])]
    return list(dict.fromkeys(every))
