"""Scores of templates against whole prints of other fingers, and the rows of the benchmark."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.index.prints.compare import similarities
from fpmatch.gallery.index.prints.prepared_prints import PreparedPrints
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.templates.minutiae import STANDARD_DPI
from research.databases import prints_of, without_ridges
from research.experiments.calibration_check import SCORES, CalibrationCheck

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
    from fpmatch.templates.minutiae import Template

FORMS: Final = ("with ridges", "minutiae alone")
AT: Final = 40.0  # the default threshold: prints that reach it count as matched
NO_FINGER: Final = -1  # of a template that is not of a finger


@dataclass(frozen=True, eq=False)
class Prints:
    """Whole prints and their fingers; databases have no finger in common."""

    templates: list[Template]
    finger: NDArray[np.intp]
    impressions: list[Any]
    dpi: list[float | None]

    @classmethod
    def of(cls, sets: Sequence[ExtractedSet]) -> Prints:
        """Return all prints of some databases that have a template."""
        rows = [
            (template, (number, impression.finger), impression, one.dataset.dpi)
            for number, one in enumerate(sets)
            for impression, template in prints_of(one)
        ]
        templates, shown, impressions, dpi = (list(column) for column in zip(*rows, strict=True))
        _, finger = np.unique(np.array(shown), axis=0, return_inverse=True)
        return cls(templates, finger.ravel(), impressions, dpi)

    @classmethod
    def made(cls, fingers: int, seed: int) -> Prints:
        """Return templates of synthetic fingers, made without images, one a finger."""
        templates = list(make_templates(seed, range(1, fingers + 1)))
        nothing: list[Any] = [None] * fingers
        return cls(templates, np.arange(fingers), nothing, [STANDARD_DPI] * fingers)

    def take(self, chosen: NDArray[np.bool_]) -> Prints:
        """Return some of the prints."""
        which = np.flatnonzero(chosen)
        return Prints(
            [self.templates[k] for k in which],
            self.finger[which],
            [self.impressions[k] for k in which],
            [self.dpi[k] for k in which],
        )

    @property
    def searched(self) -> NDArray[np.bool_]:
        """The prints that wolves are searched on: those of every other finger."""
        return np.asarray(self.finger % 2 == 0)


@dataclass(frozen=True, eq=False)
class References:
    """The prepared prints of a form that templates are compared with."""

    many: PreparedPrints
    finger: NDArray[np.intp]
    searched: NDArray[np.bool_]

    @classmethod
    def of(cls, prints: Prints, form: str) -> References:
        """Prepare prints as they are, or their minutiae alone."""
        made = [MATCHER.prepare(in_form(template, form)) for template in prints.templates]
        return cls(PreparedPrints.pack(made), prints.finger, prints.searched)


@dataclass(frozen=True, eq=False)
class Probe:
    """A template that should match nothing."""

    template: Template
    finger: int = NO_FINGER  # its finger; `NO_FINGER` for none
    pixels: NDArray[np.uint8] | None = None  # the composed image that it was extracted from


@dataclass(frozen=True, eq=False)
class Row:
    """The scores of templates of one kind and size against references of one form.

    `kind`, `size`: of the templates; the size is in minutiae, of crops and composed images in
    pixels. `probes`, `references`: whether they have ridges, one of `FORMS`.
    """

    kind: str
    size: int
    probes: str
    references: str
    templates: int  # their number
    check: CalibrationCheck  # the comparisons that reach each score
    highest: float
    worst: Probe | None  # the template that matches the most of the prints that were searched on
    worst_share: float  # the share of the other prints that it matches
    adversarial: bool = False  # whether the templates were searched for

    def as_json(self) -> dict[str, Any]:
        """Return the row as JSON values."""
        return {
            "kind": self.kind,
            "size": self.size,
            "probes": self.probes,
            "references": self.references,
            "templates": self.templates,
            "adversarial": self.adversarial,
            **self.check.as_json(),
            "highest": round(self.highest, 2),
            "worst_share": round(self.worst_share, 5),
        }


def in_form(template: Template, form: str) -> Template:
    """Return a template as it is, or without its ridges."""
    return template if form == FORMS[0] else without_ridges(template)


def scores_of(
    matcher: UnitCircleMatcher,
    calibration: Calibration,
    probe: Template,
    references: PreparedPrints,
) -> NDArray[np.float64]:
    """Return the score of a template against each of many prints; all scores come from here."""
    return calibration.scores(similarities(matcher, matcher.prepare(probe), references))


def measured(
    kind: str,
    size: int,
    probes: Iterable[Probe],
    forms: tuple[str, str],
    references: References,
    *,
    adversarial: bool = False,
    workers: int | None = None,
) -> Row:
    """Compare templates with all prints of other fingers."""
    calibration = load_calibration(MATCHER.name)
    given = list(probes)

    def of_one(probe: Probe) -> NDArray[np.float64]:
        return scores_of(MATCHER, calibration, probe.template, references.many)

    with ThreadPoolExecutor(workers) as pool:
        score = np.array([*pool.map(of_one, given)]).reshape(len(given), len(references.finger))
    finger = np.array([probe.finger for probe in given], np.intp)
    other = finger[:, None] != references.finger
    counted = other & ~references.searched if adversarial else other
    reached = tuple(int(np.count_nonzero(score[counted] >= at)) for at in SCORES)
    matched = (score >= AT) & other
    seen, unseen = references.searched, ~references.searched
    worst = matched[:, seen].sum(axis=1).argmax() if given else None
    share = 0.0
    if worst is not None:
        share = matched[worst, unseen].sum() / max(int(other[worst, unseen].sum()), 1)
    return Row(
        kind,
        size,
        *forms,
        len(given),
        CalibrationCheck(f"{kind} {size}", int(counted.sum()), reached),
        float(score[counted].max(initial=0.0)),
        None if worst is None else given[worst],
        float(share),
        adversarial,
    )
