"""Matchers and formats of other packages, which name them as entry points.

A package states them in its pyproject.toml, as docs/how-to/add_a_matcher.md shows:
``[project.entry-points."fpmatch.matchers"]`` and ``[project.entry-points."fpmatch.formats"]``.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

MATCHERS: Final = "fpmatch.matchers"
FORMATS: Final = "fpmatch.formats"


class PluginError(FpmatchError):
    """A matcher or format of another package cannot be loaded."""


@dataclass(frozen=True, slots=True)
class Plugins:
    """Hold the plug-ins of a group: those that were loaded, by name, and why others were not."""

    loaded: dict[str, Any]
    failures: dict[str, str]


@cache
def entry_points_of(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group by name, without importing what they name."""
    from importlib.metadata import entry_points  # noqa: PLC0415  (reads all packages' metadata)

    return {point.name: point for point in entry_points(group=group)}


def load_plugins(group: str) -> Plugins:
    """Load all plug-ins of a group; one that cannot be loaded does not stop the others."""
    loaded, failures = {}, {}
    for name, point in entry_points_of(group).items():
        try:
            loaded[name] = load_object(point.value)
        except PluginError as error:
            failures[name] = str(error)
    return Plugins(loaded, failures)


def load_object(place: str) -> Any:
    """Return the object at ``package.module:OBJECT``; of a class, an instance.

    Raises
    ------
    PluginError
        If the module cannot be imported, for whatever reason, or has no such object.

    Examples
    --------
    >>> load_object("math:pi") > 3
    True
    """
    module, _, name = place.partition(":")
    try:
        found = importlib.import_module(module)
        for part in name.split("."):
            found = getattr(found, part)
        return found() if isinstance(found, type) else found
    except Exception as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise PluginError(f"{place} cannot be loaded: {why}", code="plug-in") from error
