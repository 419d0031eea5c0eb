"""The matchers and their parameters, as `fpmatch doctor --matchers` lists them."""

from __future__ import annotations

import math
from typing import Any

from fpmatch.base.parameters import Parameter, Parametrised, stages_of
from fpmatch.base.plugins import MATCHERS, load_plugins
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher, matcher_names, own_matcher_names
from fpmatch.printable import printable, text_table


def matchers_document() -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Return the parameters of all matchers that can be loaded, by matcher and step.

    A limit or value is None where it is infinite.
    """
    return {
        name: {step: [_as_dict(one) for one in many] for step, many in _steps(name).items()}
        for name in _usable()
    }


def matchers_text() -> str:
    """Return the same as lines for people."""
    blocks, shown = [], dict[int, str]()
    for name in _usable():
        parameters = getattr(get_matcher(name), "parameters", None)
        alike = shown.setdefault(id(parameters), name)
        lines = [printable(name)]
        if not (steps := _steps(name)):
            lines[0] += ": no parameters"
        elif alike != name:
            lines[0] += f": the parameters of {printable(alike)}"
        else:
            for step, many in steps.items():
                table = text_table([_row(one) for one in many], left=5)
                lines += [f"  {step}", *(f"    {line}" for line in table.splitlines())]
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks)


def _usable() -> list[str]:
    """Return the names of the matchers that can be loaded, the default first."""
    failures = matcher_failures()
    names = sorted(matcher_names(), key=lambda name: name != DEFAULT_MATCHER)
    return [name for name in names if name not in failures]


def _steps(name: str) -> dict[str, list[Parameter]]:
    """Return the parameters of a matcher by step; none where it has none."""
    matcher = get_matcher(name)
    return stages_of(matcher.parameters) if isinstance(matcher, Parametrised) else {}


def _as_dict(one: Parameter) -> dict[str, Any]:
    return {name: None if value == math.inf else value for name, value in one._asdict().items()}


def _row(one: Parameter) -> list[str]:
    """Return name, default, range, unit and meaning."""
    limits = f"{one.least:g} to {one.most:g}"
    return [one.name, f"{one.value:g}", limits, one.unit, one.meaning]


def matcher_failures() -> dict[str, str]:
    """Return the names of matchers of other packages that cannot be loaded, each with the reason.

    All of them are imported.
    """
    failures, own = load_plugins(MATCHERS).failures, own_matcher_names()
    return {name: why for name, why in failures.items() if name not in own}
