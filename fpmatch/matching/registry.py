"""Find matchers by name: those of this package by their files, those of others as plug-ins.

A matcher is one module of `fpmatch.matching.matchers` that defines ``MATCHER``, of the shape of
`fpmatch.matching.result.Matcher`. File ``unit_circle.py`` is the matcher "unit-circle". Other
packages add matchers by entry points, see `fpmatch.base.plugins`.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import TYPE_CHECKING, Final

from fpmatch.errors import MatcherError, did_you_mean

if TYPE_CHECKING:
    from fpmatch.matching.result import Matcher

DEFAULT_MATCHER: Final = "unit-circle"
_MATCHERS: Final = "fpmatch.matching.matchers"  # imported by name, as plug-ins are


def matcher_names() -> list[str]:
    """Return the names of all matchers, in alphabetical order, without importing any.

    Those of other packages are among them, see `fpmatch.base.plugins`.

    Examples
    --------
    >>> from fpmatch import matcher_names
    >>> "unit-circle" in matcher_names()
    True
    """
    from fpmatch.base.plugins import MATCHERS, plugin_names  # noqa: PLC0415

    return sorted({*own_matcher_names(), *plugin_names(MATCHERS)})


def matcher_failures() -> dict[str, str]:
    """Return the names of matchers of other packages that cannot be loaded, each with the reason.

    All of them are imported.
    """
    from fpmatch.base.plugins import MATCHERS, load_plugins  # noqa: PLC0415

    failures, own = load_plugins(MATCHERS).failures, own_matcher_names()
    return {name: why for name, why in failures.items() if name not in own}


def get_matcher(name: str) -> Matcher:
    """Return the matcher called `name`, importing its module on first use.

    Parameters
    ----------
    name : str
        A name of `matcher_names`, or the place of a matcher, ``package.module:OBJECT``.

    Raises
    ------
    MatcherError
        If there is no matcher of that name, or that of another package cannot be loaded.
    """
    if name in own_matcher_names():
        module = importlib.import_module(f"{_MATCHERS}.{name.replace('-', '_')}")
        own: Matcher = module.MATCHER
        return own
    from fpmatch.base.plugins import MATCHERS, PluginError, load_plugin, plugin_names  # noqa: PLC0415

    if ":" not in name and name not in plugin_names(MATCHERS):
        question = did_you_mean(name, matcher_names())
        raise MatcherError(
            f"unknown matcher {name!r}; known: {', '.join(matcher_names())}, and any "
            f"package.module:OBJECT{'.' * bool(question)}{question}"
        )
    try:
        matcher: Matcher = load_plugin(MATCHERS, name)
    except PluginError as error:
        subject = "matcher" if ":" in name else f"matcher {name}:"
        raise MatcherError(f"{subject} {error}", code="plug-in") from error
    return matcher


def matcher_name(name: str) -> str:
    """Return the name of a matcher that is given by its name or its place; raises MatcherError."""
    return get_matcher(name).name if ":" in name else name


def own_matcher_names() -> set[str]:
    """Return the names of the matchers of this package."""
    modules = pkgutil.iter_modules(importlib.import_module(_MATCHERS).__path__)
    return {m.name.replace("_", "-") for m in modules if not m.name.startswith("_")}
