"""The matchers and their parameters, as `fpmatch doctor --matchers` lists them."""

from __future__ import annotations

import math
from typing import Any

from fpmatch.base.parameters import Parameter, parameters_of
from fpmatch.base.plugins import MATCHERS, load_plugins
from fpmatch.matching.registry import DEFAULT_MATCHER, OWN_MATCHERS, get_matcher, matcher_names
from fpmatch.printable import printable, text_table


def matchers_document() -> dict[str, list[dict[str, Any]]]:
    """Return the parameters of each matcher that can be loaded, by its name.

    A limit or value is None where it is infinite.
    """
    return {
        name: [_as_dict(one) for one in parameters_of(get_matcher(name).parameters).values()]
        for name in _usable()
    }


def matchers_text() -> str:
    """Return the same as lines for people."""
    blocks, shown = [], dict[int, str]()
    for name in _usable():
        listed = parameters_of(parameters := get_matcher(name).parameters)
        alike = shown.setdefault(id(parameters), name)
        if not listed:
            blocks.append(f"{printable(name)}: no parameters")
        elif alike != name:
            blocks.append(f"{printable(name)}: the parameters of {printable(alike)}")
        else:
            table = text_table([_row(one) for one in listed.values()], left=5)
            lines = [printable(name), *(f"    {line}" for line in table.splitlines())]
            blocks.append("\n".join(lines))
    return "\n\n".join(blocks)


def matcher_failures() -> dict[str, str]:
    """Return why matchers of other packages cannot be loaded, by name; all are imported."""
    failures = load_plugins(MATCHERS)[1]
    return {name: why for name, why in failures.items() if name not in OWN_MATCHERS}


def _usable() -> list[str]:
    """Return the names of the matchers that can be loaded, the default first."""
    names = sorted(matcher_names(), key=lambda name: name != DEFAULT_MATCHER)
    failures = matcher_failures()
    return [name for name in names if name not in failures]


def _as_dict(one: Parameter) -> dict[str, Any]:
    return {name: None if value == math.inf else value for name, value in one._asdict().items()}


def _row(one: Parameter) -> list[str]:
    """Return name, default, range, unit and meaning."""
    limits = f"{one.least:g} to {one.most:g}"
    return [one.name, f"{one.value:g}", limits, one.unit, one.meaning]
