"""Evaluation of open-set identification on databases of prints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.lab.evaluation.databases.protocol import finger_numbers
from fpmatch.lab.evaluation.open_set.background import no_background
from fpmatch.lab.evaluation.open_set.rates import FPIRS, OpenSetRates, open_set_rates
from fpmatch.lab.evaluation.open_set.report import (
    IdentificationReport,
    IdentificationRow,
    Presented,
)
from fpmatch.lab.evaluation.open_set.roles import GROUPS, Roles, group_fingers, subject_of
from fpmatch.lab.evaluation.open_set.searches import search_all
from fpmatch.lab.evaluation.rates.bootstrap import DEFAULT_BOOTSTRAP, draw_fingers
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher
from fpmatch.printable import count

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.lab.evaluation.databases.protocol import Impression
    from fpmatch.lab.evaluation.open_set.searches import Background, Presentation
    from fpmatch.matching.result import Matcher

MIN_IMPRESSIONS: Final = 2


@dataclass(frozen=True, slots=True)
class IdentificationTest:
    """Set how identification is tested.

    A subject is `fingers` fingers. `fpirs` are the false positive identification rates at which the
    FNIR is reported. `seed` draws the subjects that are enrolled, and the `bootstrap` replicates of
    the intervals (0: none). `options` are those of `fpmatch.gallery.search.identify.identify`.
    """

    fingers: int = 1
    fpirs: Sequence[float] = FPIRS
    bootstrap: int = DEFAULT_BOOTSTRAP
    seed: int = 0
    options: tuple[tuple[str, Any], ...] = ()


def evaluate_identification(
    sets: Sequence[ExtractedSet],
    background: Background | None = None,
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    test: IdentificationTest = IdentificationTest(),
    progress: Progress = no_progress,
) -> IdentificationReport:
    """Search for the prints of databases in one gallery, a third of them with a mate there.

    `sets`: the databases, of different fingers, and their templates; see `extract_datasets`.
    `background`: prints of further fingers that are in the gallery; see `load_background`.
    `matcher`: the matcher, or its name. `test`: how it is tested. `progress`: called with stage
    "search" and numbers of searches. Raises a `DatasetError` if no subject has two impressions, or
    there are fewer than three subjects; a `MatcherError` if the matcher is unknown or not
    calibrated; a `TemplateError` if a gallery cannot store a template.
    """
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    calibration = load_calibration(chosen.name)
    loaded = [load_subjects(one, test.fingers) for one in sets]
    sizes = [[len(shown) for shown in of_set] for of_set in loaded]
    for one, of_set in zip(sets, sizes, strict=True):
        if not of_set:
            raise DatasetError(f"{one.dataset.name}: has fewer than {test.fingers} fingers")
    roles = Roles.draw(sizes, test.seed)
    if len(roles.sizes) < GROUPS:
        of = count(len(roles.sizes), "subject") + f" of {count(test.fingers, 'finger')}"
        raise DatasetError(f"{of}: identification needs at least {GROUPS}")
    if roles.turns < MIN_IMPRESSIONS:
        raise DatasetError("identification needs a subject with two impressions")
    searches = search_all(
        [one for of_set in loaded for shown in of_set for one in shown],
        roles,
        background or no_background(chosen),
        calibration,
        progress=progress,
        **dict(test.options),
    )
    database = np.repeat(np.arange(len(sets)), list(map(len, sizes)))
    draws = [
        draw_fingers(len(of_set), test.bootstrap, test.seed, k) for k, of_set in enumerate(sizes)
    ]
    every = np.concatenate(draws, axis=1) if test.bootstrap else None

    def rates(which: NDArray[np.bool_]) -> OpenSetRates:
        drawn = None if every is None else np.where(which, every, 0)
        part = searches.of(which[roles.subject])
        return open_set_rates(part, roles.subject, fpirs=test.fpirs, draws=drawn)

    rows = tuple(
        IdentificationRow(
            name=one.dataset.name,
            subjects=len(of_set),
            prints=len(one.extractions),
            failures=len(one.failures),
            rates=rates(database == k),
        )
        for k, (one, of_set) in enumerate(zip(sets, sizes, strict=True))
    )
    return IdentificationReport(
        matcher=chosen.name,
        fingers=test.fingers,
        background=0 if background is None else int(background.subject.max(initial=-1)) + 1,
        enrolled=(int(searches.enrolled.min()), int(searches.enrolled.max())),
        bootstrap=test.bootstrap,
        seed=test.seed,
        sets=rows,
        pooled=rates(np.ones(len(database), bool)),
        searches=searches,
        presented=tuple(
            Presented(k, impressions)
            for k, one in enumerate(sets)
            for subject in _impressions_of_subjects(one.dataset.impressions, test.fingers)
            for impressions in subject
        ),
    )


def load_subjects(extracted: ExtractedSet, fingers: int) -> list[list[Presentation]]:
    """Return the presentations of each subject, of `fingers` fingers, of a database.

    Fingers of a subject, where their names contain it, make up a subject; else each with the next,
    in the order of their names. Impressions that not all of its fingers have are left out.
    """
    templates = [one.template for one in extracted.extractions]
    subjects = _impressions_of_subjects(extracted.dataset.impressions, fingers)
    return [[tuple(templates[n] for n in shown) for shown in subject] for subject in subjects]


def _impressions_of_subjects(
    impressions: Sequence[Impression], fingers: int
) -> list[list[tuple[int, ...]]]:
    """Return the presentations of each subject as numbers of impressions; see `load_subjects`."""
    of_finger: dict[int | str, list[int]] = {}
    for number in np.argsort(finger_numbers(impressions), kind="stable").tolist():
        of_finger.setdefault(impressions[number].finger, []).append(number)
    each = list(of_finger.values())
    groups = group_fingers([subject_of(finger) for finger in of_finger], fingers)
    return [list(zip(*(each[k] for k in group), strict=False)) for group in groups]
