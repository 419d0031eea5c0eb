"""Parameters: the numbers of a flat frozen dataclass, with ranges, given as NAME=VALUE."""

from __future__ import annotations

import math
from dataclasses import field, fields, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from fpmatch.errors import MatcherError, did_you_mean, number_text

if TYPE_CHECKING:
    from collections.abc import Mapping

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
        kind = type(self.value)
        try:
            value = math.nan if isinstance(given, bool) else kind(cast("str", given))
        except (TypeError, ValueError, OverflowError):
            value = math.nan
        if math.isnan(value) or not (isinstance(given, str) or value == given):
            what = "a whole number" if kind is int else "a number"
            raise MatcherError(f"{owner}: {self.name} is {what}, not {given!r}", code="kind")
        self._replace(value=value).check()
        return value

    def check(self) -> None:
        """Raise MatcherError if its value is out of range."""
        if not self.least <= self.value <= self.most:
            limits = f"from {self.least:g} to {self.most:g}"
            why = f"{self.name} lies {limits}, not {number_text(self.value)}"
            raise MatcherError(why, code="range")


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
    return field(default=default, metadata={"about": (meaning, unit, least, most)})


def parameters_of(values: Any) -> dict[str, Parameter]:
    """Return the parameters of a dataclass, with their present values, by name; none of None."""
    listed = {}
    for entry in fields(values) if values is not None else ():
        if about := entry.metadata.get("about"):
            meaning, unit, *limits = about
            by_name = (one for suffix, one in _UNITS.items() if entry.name.endswith(suffix))
            value, unit = getattr(values, entry.name), unit or next(by_name, "")
            listed[entry.name] = Parameter(entry.name, value, meaning, unit, *limits)
    return listed


class Ranged:
    """Base of a dataclass of parameters; raises MatcherError for one outside its range."""

    __slots__ = ()

    def __post_init__(self) -> None:
        for entry in fields(cast("Any", self)):
            about = entry.metadata.get("about")
            if about and not about[2] <= getattr(self, entry.name) <= about[3]:
                parameters_of(self)[entry.name].check()  # which raises it


def with_parameters(values: Any, given: Mapping[str, object], owner: str) -> Any:
    """Return a dataclass with other values, numbers or texts of numbers.

    Raises MatcherError for an unknown name, a value of another kind, or one out of range.
    """
    known = parameters_of(values)
    for name in given:
        if name not in known:
            raise MatcherError(
                f"{owner} has no parameter {name!r}.{did_you_mean(name, known)} "
                "`fpmatch doctor --matchers` lists them",
                code="parameter",
            )
    return replace(values, **{name: known[name].read(one, owner) for name, one in given.items()})


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


def changed_parameters(usual: Any, values: Any) -> str:
    """Return those that differ from the usual ones as NAME=VALUE,NAME=VALUE."""
    before, after = parameters_of(usual), parameters_of(values)
    changed = [one for name, one in after.items() if one != before[name]]
    return ",".join(f"{one.name}={repr(one.value).removesuffix('.0')}" for one in changed)
