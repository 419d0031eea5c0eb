"""Parameters: numbers in frozen dataclasses with meaning, unit and range, given as NAME=VALUE.

A dataclass of parameters makes its fields by `parameter`, or has other such dataclasses as fields.
A name may occur in several of them, for one quantity; all are then set together.
"""

from __future__ import annotations

import math
from dataclasses import field, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from fpmatch.errors import MatcherError, did_you_mean, number_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_UNITS: Final = {"_per_px": "px per px", "_px": "px at 500 dpi", "_deg": "degrees"}


class Parameter(NamedTuple):
    """One parameter: its value, what it means, and the values that it may have."""

    name: str
    value: float
    meaning: str
    unit: str
    least: float
    most: float

    def read(self, given: object, owner: str) -> float:
        """Return the number that is given for it, as a number or text; else raise MatcherError."""
        whole = isinstance(self.value, int)
        try:
            value: float = (int if whole else float)(cast("str", given))
        except (TypeError, ValueError, OverflowError):
            value = math.nan
        if isinstance(given, bool) or not (isinstance(given, str) or value == given):
            value = math.nan
        if math.isnan(value):
            kind = "a whole number" if whole else "a number"
            raise MatcherError(f"{owner}: {self.name} is {kind}, not {given!r}", code="kind")
        if not self.least <= value <= self.most:
            limits = f"from {self.least:g} to {self.most:g}"
            shown = given if isinstance(given, str) else number_text(value)
            raise MatcherError(f"{owner}: {self.name} lies {limits}, not {shown}", code="range")
        return value


def parameter(default: float, meaning: str, least: float, most: float, unit: str = "") -> Any:
    """Return the field of a parameter of a dataclass.

    Parameters
    ----------
    default : int or float
        Its default; of an int, only whole numbers are accepted.
    meaning : str
        What it is, as ``fpmatch doctor --matchers`` shows it.
    least, most : float
        The range of its values.
    unit : str
        Its unit, unless the suffix of its name states it: ``_px``, ``_per_px`` or ``_deg``.
    """
    about = {"meaning": meaning, "least": least, "most": most, "unit": unit}
    return field(default=default, metadata=about)


def parameters_of(values: Any) -> dict[str, Parameter]:
    """Return the parameters of a dataclass, with their present values, by name."""
    return {one.name: one for _, one in _listed(values)}


def stages_of(values: Any) -> dict[str, list[Parameter]]:
    """Return the parameters by the first lines of the docstrings of their dataclasses."""
    stages: dict[str, list[Parameter]] = {}
    for kind, one in _listed(values):
        stages.setdefault(str(kind.__doc__).partition("\n")[0].rstrip("."), []).append(one)
    return stages


def with_parameters(values: Any, given: Mapping[str, object], owner: str) -> Any:
    """Return a dataclass with other values; raise MatcherError for an unknown name or bad value."""
    known = parameters_of(values)
    for name in given:
        if name not in known:
            raise MatcherError(
                f"{owner} has no parameter {name!r}.{did_you_mean(name, known)} "
                "`fpmatch doctor --matchers` lists them",
                code="parameter",
            )
    return _replaced(values, {name: known[name].read(one, owner) for name, one in given.items()})


def read_parameters(text: str, owner: str) -> dict[str, str]:
    """Return names and values of the text NAME=VALUE,NAME=VALUE; raise MatcherError for another."""
    given: dict[str, str] = {}
    for part in text.split(","):
        name, equals, value = part.partition("=")
        if not (name and equals and value):
            raise MatcherError(f"{owner}: parameters are NAME=VALUE, not {part!r}", code="form")
        if name in given:
            raise MatcherError(f"{owner}: {name} is given twice", code="form")
        given[name] = value
    return given


class Parametrised:
    """A matcher whose keyword arguments are the entries of the dataclass `parameters`.

    Its name states the parameters that differ from the default, so that no score, calibration or
    file is taken for that of a matcher with other parameters. A subclass defines `name`, and
    `parameters` with the defaults.

    Raises
    ------
    MatcherError
        If there is no such parameter, or a value is of another kind or out of range.

    Examples
    --------
    >>> from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
    >>> UnitCircleMatcher(rounds=5, reach_px=10.0).name
    'unit-circle:rounds=5'
    """

    name: str
    parameters: Any

    def __init__(self, **given: float | str) -> None:
        usual, own = type(self).parameters, type(self).name
        made = with_parameters(usual, given, f"matcher {own}")
        before = parameters_of(usual)
        if changed := [one for one in parameters_of(made).values() if one != before[one.name]]:
            self.name = f"{own}:{','.join(f'{one.name}={_short(one.value)}' for one in changed)}"
            self.parameters = made


def _short(value: float) -> str:
    """Return a number as text from which it is read again."""
    return repr(value).removesuffix(".0")


def _listed(values: Any) -> Iterator[tuple[type, Parameter]]:
    """Yield the parameters of a dataclass, each with the dataclass that has it; once each."""
    seen: set[str] = set()
    for entry in fields(values):
        value, about = getattr(values, entry.name), entry.metadata
        inner = list(_listed(value)) if is_dataclass(value) else []
        if "meaning" in about:
            by_name = (unit for suffix, unit in _UNITS.items() if entry.name.endswith(suffix))
            limits = about["unit"] or next(by_name, ""), about["least"], about["most"]
            inner = [(type(values), Parameter(entry.name, value, about["meaning"], *limits))]
        for kind, one in inner:
            if one.name not in seen:
                seen.add(one.name)
                yield kind, one


def _replaced(values: Any, given: Mapping[str, float]) -> Any:
    """Return a dataclass with these values, wherever their names occur."""
    changed: dict[str, Any] = {}
    for entry in fields(values):
        value = getattr(values, entry.name)
        if is_dataclass(value):
            changed[entry.name] = _replaced(value, given)
        elif "meaning" in entry.metadata and entry.name in given:
            changed[entry.name] = given[entry.name]
    return replace(values, **changed) if changed else values
