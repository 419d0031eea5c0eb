"""Find matchers by name: those of this package, and those of others as plug-ins.

Those of this package stand in `OWN_MATCHERS`. Other packages add theirs by entry points, see
`fpmatch.base.plugins`.
"""

from __future__ import annotations

import importlib
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from fpmatch.base.parameters import read_parameters
from fpmatch.base.plugins import MATCHERS, PLUG_IN, PluginError, load_plugin, plugin_names
from fpmatch.errors import MatcherError, unknown_name

if TYPE_CHECKING:
    from fpmatch.matching.result import Matcher

DEFAULT_MATCHER: Final = "unit-circle"
OWN_MATCHERS: Final = {  # objects of modules in `fpmatch.matching.matchers`, by name
    "paper": ("paper", "MATCHER"),
    "reference": ("unit_circle", "REFERENCE"),
    "unit-circle": ("unit_circle", "MATCHER"),
}


def matcher_names() -> list[str]:
    """Return the names of all matchers, in alphabetical order, without importing any.

    Those of other packages are among them, see `fpmatch.base.plugins`.

    Examples
    --------
    >>> from fpmatch import matcher_names
    >>> "unit-circle" in matcher_names()
    True
    """
    return sorted({*OWN_MATCHERS, *plugin_names(MATCHERS)})


def get_matcher(name: str) -> Matcher:
    """Return the matcher called `name`, importing its module on first use; raise MatcherError.

    The name is one of `matcher_names`, or a place, ``package.module:OBJECT``; perhaps with
    parameters, of which the usual ones are not in the matcher's own name:

    >>> get_matcher("unit-circle:reach_px=12,rounds=3").name
    'unit-circle:reach_px=12'
    """
    if name in OWN_MATCHERS:
        module, entry = OWN_MATCHERS[name]
        own = importlib.import_module(f"fpmatch.matching.matchers.{module}")
        matcher: Matcher = getattr(own, entry)
        return matcher
    plain, parameters = split_name(name)
    if parameters:
        return _parametrised(plain, parameters)
    if ":" not in name and name not in plugin_names(MATCHERS):
        known = unknown_name("matcher", name, matcher_names())
        raise MatcherError(f"{known} (or any package.module:OBJECT)")
    try:
        matcher = load_plugin(MATCHERS, name)
    except PluginError as error:
        subject = "matcher" if ":" in name else f"matcher {name}:"
        raise MatcherError(f"{subject} {error}", code=PLUG_IN) from error
    return matcher


def split_name(name: str) -> tuple[str, str]:
    """Return the name or place of a matcher, and the text of its parameters, "" without any.

    >>> split_name("paper:rho=0.9"), split_name("package.module:OBJECT")
    (('paper', 'rho=0.9'), ('package.module:OBJECT', ''))
    """
    plain, _, last = name.rpartition(":")
    return (plain, last) if plain and ("=" in last or plain in OWN_MATCHERS) else (name, "")


def states_rho(name: str) -> bool:
    """Return whether the name of a matcher states the share that decides, which no score does."""
    return ",rho=" in f",{split_name(name)[1]}"


@lru_cache(maxsize=16)
def _parametrised(name: str, text: str) -> Matcher:
    """Return a matcher with parameters, always the same one."""
    matcher = get_matcher(name)
    return type(matcher)(**read_parameters(text, f"matcher {matcher.name}"))
