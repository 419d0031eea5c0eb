"""The matchers: one public module each, found by its file name.

A matcher is one module of this package that defines ``MATCHER``, of the shape of
`fpmatch.matching.result.Matcher`. File ``unit_circle.py`` is the matcher "unit-circle".
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import TYPE_CHECKING, Final

from fpmatch.errors import MatcherError

if TYPE_CHECKING:
    from fpmatch.matching.result import Matcher

DEFAULT_MATCHER: Final = "unit-circle"


def matcher_names() -> list[str]:
    """Return the names of all matchers, in alphabetical order, without importing any.

    Examples
    --------
    >>> "unit-circle" in matcher_names()
    True
    """
    modules = pkgutil.iter_modules(__path__)
    return sorted(m.name.replace("_", "-") for m in modules if not m.name.startswith("_"))


def get_matcher(name: str) -> Matcher:
    """Return the matcher called `name`, importing its module on first use.

    Raises
    ------
    MatcherError
        If there is no matcher of that name.
    """
    known = matcher_names()
    if name not in known:
        raise MatcherError(f"unknown matcher {name!r}; known: {', '.join(known) or 'none'}")
    module = importlib.import_module(f"{__name__}.{name.replace('-', '_')}")
    matcher: Matcher = module.MATCHER
    return matcher
