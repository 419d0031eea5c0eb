"""Matchers and formats of other packages, which name them as entry points.

A package states them in its pyproject.toml, as docs/how-to/add_a_matcher.md shows:
``[project.entry-points."fpmatch.matchers"]``; the other group is ``fpmatch.formats``.
"""

from __future__ import annotations

import importlib
import traceback
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import FpmatchError, MatcherError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

MATCHERS: Final = "fpmatch.matchers"
FORMATS: Final = "fpmatch.formats"
AN2_SIGNATURES: Final = (b"1.001:", b"1.01:")
FMR_SIGNATURE: Final = b"FMR\x00"  # of finger minutiae records
PLUG_IN: Final = "plug-in"  # the code of errors of plug-ins
_AGENCY: Final = "fpmatch.formats.agency"
_MATCHER: Final = "fpmatch.matching.result.Matcher"  # the base class, not imported from here
_PARTS: Final = {  # what an object of a group must have
    MATCHERS: ("name",),
    FORMATS: ("name", "title", "suffixes", "recognises", "decode", "encode"),
}


class PluginError(FpmatchError):
    """A plug-in of another package cannot be loaded."""


def plugin_names(group: str) -> list[str]:
    """Return the names of the plug-ins of a group, without importing any."""
    return sorted(_entry_points(group))


def load_plugin(group: str, name: str) -> Any:
    """Return a plug-in by a name of `plugin_names`, or its place, ``package.module:OBJECT``.

    Of a class at this place, one instance is made. Raises PluginError if there is none of that
    name, or it cannot be imported, or is of another shape.
    """
    if ":" in name:
        return _load(group, name)
    points = _entry_points(group).get(name, ())
    if not points:
        raise PluginError(f"no package names it in the entry points {group}", code="unknown")
    if len(points) > 1:
        packages = ", ".join(sorted(point.dist.name for point in points if point.dist))
        raise PluginError(f"several packages have one of this name: {packages}", code="ambiguous")
    place = f"{points[0].module}:{points[0].attr or ''}"
    plugin = _load(group, place)
    if plugin.name != name:
        raise PluginError(
            f"{place} is named {plugin.name!r}, its entry point {name!r}", code="name"
        )
    return plugin


@cache
def load_plugins(group: str) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the plug-ins of a group by name, and why those cannot be loaded that are not."""
    loaded: dict[str, Any] = {}
    failures: dict[str, str] = {}
    for name in plugin_names(group):
        try:
            loaded[name] = load_plugin(group, name)
        except PluginError as error:
            failures[name] = str(error)
    return loaded, failures


def agency(module: str) -> Any:
    """Import a module of the formats of agencies, which loads with the first file of theirs.

    They are an optional part of the package: raises PluginError where it is left out.
    """
    try:
        return importlib.import_module(f"{_AGENCY}.{module}")
    except ModuleNotFoundError as error:
        raise PluginError(f"a format of agencies: {_AGENCY} is not installed") from error


def plugin_source(group: str, name: str) -> str:
    """Return the packages of a plug-in with their versions, and the place of the object."""
    points = _entry_points(group).get(name, ())
    return "; ".join(
        f"{point.dist.name} {point.dist.version}, {point.value}" if point.dist else point.value
        for point in points
    )


def forget_plugins() -> None:
    """Let the next use look for plug-ins again: packages were installed since the last."""
    importlib.invalidate_caches()
    for function in (_entry_points, _load, load_plugins):
        function.cache_clear()


def call_matcher(matcher: Any, method: str, *given: Any) -> Any:
    """Call a method of a matcher; raise MatcherError where that of a plug-in fails."""
    call = getattr(matcher, method)
    if is_own(matcher):
        return call(*given)
    try:
        return call(*given)
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"line {place.lineno} of {Path(place.filename).name}"
        raise MatcherError(
            f"matcher {matcher.name}: {method}: {type(error).__name__}: {error} ({where})",
            code=PLUG_IN,
        ) from error


def named(error: MatcherError, *prints: object) -> MatcherError:
    """Return an error of a plug-in with the names of the prints compared before it.

    Another error is raised as it is: a cause of itself would never end.
    """
    if error.code != PLUG_IN:
        raise error
    names = [*map(str, prints), *([error.path] if error.path else [])]
    return MatcherError(error.detail, path=" and ".join(names), code=PLUG_IN)


def is_own(matcher: object) -> bool:
    """Return whether a matcher is of this package, so that its answers need no check."""
    return type(matcher).__module__.startswith("fpmatch.")


@cache
def _entry_points(group: str) -> dict[str, tuple[EntryPoint, ...]]:
    """Return the entry points of a group by name."""
    from importlib.metadata import entry_points  # noqa: PLC0415  (costs 30 ms)

    points = entry_points(group=group)
    return {name: tuple(points.select(name=name)) for name in points.names}


@cache
def _load(group: str, place: str) -> Any:
    """Return the object at ``package.module:OBJECT``, an instance where it is a class."""
    module, _, name = place.partition(":")
    if not module or not name:
        raise PluginError(f"{place} is no package.module:OBJECT", code="place")
    try:
        plugin: Any = importlib.import_module(module)
        for part in name.split("."):
            plugin = getattr(plugin, part)
        plugin = plugin() if isinstance(plugin, type) else plugin
    except (Exception, SystemExit) as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        hint = ""
        if isinstance(error, ModuleNotFoundError) and f"{module}.".startswith(f"{error.name}."):
            hint = " (install its package or put its folder on PYTHONPATH: nothing is imported "
            hint += "from the working directory)"
        raise PluginError(f"{place} cannot be loaded: {why}{hint}", code=PLUG_IN) from error
    kinds = (f"{kind.__module__}.{kind.__qualname__}" for kind in type(plugin).__mro__)
    if group == MATCHERS and _MATCHER not in kinds:
        raise PluginError(f"{place} is no subclass of {_MATCHER}", code="shape")
    lacking = [part for part in _PARTS[group] if not hasattr(plugin, part)]
    if lacking:
        raise PluginError(f"{place} has no {lacking[0]!r}", code="shape")
    return plugin
