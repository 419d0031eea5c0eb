"""The searches of an open-set test: what is stated of the mate, or of the best other candidate.

Each presentation is searched for once, in a gallery of all presentations and the background. A
presentation that is not enrolled in a round is then left out of the candidates of this round. All
prints are compared, so that this changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.search.fused import identify_fused
from fpmatch.gallery.search.identification import expected_by_chance
from fpmatch.gallery.search.identify import identify
from fpmatch.lab.evaluation.open_set.roles import EnrolledSubjects

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.search.whole import WholeSearch
    from fpmatch.lab.evaluation.open_set.roles import Roles
    from fpmatch.matching.calibration import Calibration
    from fpmatch.templates.minutiae import Template

    Presentation = tuple[Template | None, ...]
    Scores = NDArray[np.float64]

LIST_LENGTH: Final = 100  # candidates of a search
NOT_LISTED: Final = LIST_LENGTH + 1
NO_SCORE: Final = -1.0  # below every score: the mate is not listed, or there is no candidate
NO_CHANCE: Final = inf  # by chance, of what is not listed


@dataclass(frozen=True, slots=True, eq=False)
class Searches:
    """The outcomes of all searches.

    Of searches with a mate, M, `mate` is its presentation, `score` and `rank` are its score and
    rank, ties counting against it, and `chance` is how many others are expected to score as high by
    chance. Of the others, L, `highest` is the highest score, `least_chance` how many are expected
    to reach it, and `first` the presentation that has it, -1 where that is not one of the test.
    `mated` and `nonmated` hold what was searched for. `enrolled` holds the number of subjects in
    the gallery of each round.
    """

    mated: NDArray[np.intp]
    mate: NDArray[np.intp]
    score: Scores
    rank: NDArray[np.intp]
    chance: NDArray[np.float64]
    nonmated: NDArray[np.intp]
    highest: Scores
    least_chance: NDArray[np.float64]
    first: NDArray[np.intp]
    enrolled: NDArray[np.intp]

    def of(self, which: NDArray[np.bool_]) -> Searches:
        """Return the searches for some of the presentations."""
        mated, nonmated = which[self.mated], which[self.nonmated]
        return replace(
            self,
            mated=self.mated[mated],
            mate=self.mate[mated],
            score=self.score[mated],
            rank=self.rank[mated],
            chance=self.chance[mated],
            nonmated=self.nonmated[nonmated],
            highest=self.highest[nonmated],
            least_chance=self.least_chance[nonmated],
            first=self.first[nonmated],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """A search of prints without mates, with the subject and the finger of each.

    Subjects are numbered from 0, fingers of a subject likewise; as for `EnrolledSubjects`.
    """

    search: WholeSearch
    subject: NDArray[np.intp]
    finger: NDArray[np.intp]


class _Gallery:
    """The presentations of a test, and the background, in one search."""

    def __init__(
        self,
        presentations: Sequence[Presentation],
        background: Background,
        calibration: Calibration,
        options: dict[str, Any],
    ) -> None:
        impressions = [
            (k, f, template)
            for k, shown in enumerate(presentations)
            for f, template in enumerate(shown)
            if template is not None
        ]
        self.presentations = presentations
        self.first = int(background.subject.max(initial=-1)) + 1  # number of the first presentation
        templates = [template for _, _, template in impressions]
        self.search = background.search.with_prints(templates)
        subject, finger = np.array([(k, f) for k, f, _ in impressions], np.intp).reshape(-1, 2).T
        self.subjects = EnrolledSubjects(
            self.search.numbers,
            np.concatenate([background.subject, subject + self.first]),
            np.concatenate([background.finger, finger]),
        )
        most = LIST_LENGTH + len(presentations)
        self.options = options | {"calibration": calibration, "count": most}
        self.options["workers"] = 1  # the engine uses all cores already

    def candidates(self, presentation: int) -> tuple[NDArray[np.intp], Scores]:
        """Return subjects and scores of the candidates."""
        shown = [(k, t) for k, t in enumerate(self.presentations[presentation]) if t is not None]
        if not shown:
            return np.empty(0, np.intp), np.empty(0)
        if len(self.presentations[presentation]) == 1:
            how = {"subjects": self.subjects, "listed": "subjects", **self.options}
            alone = identify(self.search, shown[0][1], **how)
            listed = [(self.subjects.subject_of(c.number), c.score) for c in alone.candidates]
        else:
            probes, positions = [t for _, t in shown], [str(k) for k, _ in shown]
            fused = identify_fused(
                self.search, probes, subjects=self.subjects, positions=positions, **self.options
            )
            listed = [(c.subject, c.score) for c in fused.candidates]
        subject = np.array([int(name or -1) for name, _ in listed], np.intp)
        return subject, np.array([score for _, score in listed])


def search_all(
    presentations: Sequence[Presentation],
    roles: Roles,
    background: Background,
    calibration: Calibration,
    *,
    progress: Progress = no_progress,
    **options: Any,
) -> Searches:
    """Search for all presentations of a test, in all rounds.

    A presentation has the template of each finger, None where there is none, in the order of the
    `roles`. The search of the `background`, which may have no prints, has the matcher. `options`
    are those of `fpmatch.gallery.search.identify.identify`.
    """
    gallery = _Gallery(presentations, background, calibration, options)
    rounds = [[roles.enrolled(g, t) for g in np.unique(roles.group)] for t in range(roles.turns)]
    of_fingers = len(presentations[0]) == 1
    of_background = zip(background.subject.tolist(), background.finger.tolist(), strict=True)
    further = len({*of_background}) if of_fingers else gallery.first
    there = np.array([any(t is not None for t in shown) for shown in presentations])
    among = [[further + int(there[e].sum()) for e in groups] for groups in rounds]
    mated: list[tuple[float, ...]] = []
    nonmated: list[tuple[float, ...]] = []
    for k in range(len(presentations)):
        progress("search", k, len(presentations))
        subject, score = gallery.candidates(k)
        own = subject >= gallery.first
        of_own = np.full(len(presentations), NO_SCORE)
        of_own[subject[own] - gallery.first] = score[own]
        outcomes = _outcomes(k, roles, rounds, among, of_own, score[~own])
        for has_mate, *outcome in outcomes:
            (mated if has_mate else nonmated).append((k, *outcome))
    progress("search", len(presentations), len(presentations))
    of_round = np.array([len(enrolled) for turn in rounds for enrolled in turn])
    with_mate, without = (np.array(rows).reshape(-1, 5) for rows in (mated, nonmated))
    return Searches(
        mated=with_mate[:, 0].astype(np.intp),
        mate=with_mate[:, 1].astype(np.intp),
        score=with_mate[:, 2],
        rank=with_mate[:, 3].astype(np.intp),
        chance=with_mate[:, 4],
        nonmated=without[:, 0].astype(np.intp),
        first=without[:, 1].astype(np.intp),
        highest=without[:, 2],
        least_chance=without[:, 4],
        enrolled=gallery.first + of_round,
    )


def _outcomes(
    k: int,
    roles: Roles,
    rounds: Sequence[Sequence[NDArray[np.intp]]],
    among: Sequence[Sequence[int]],
    of_own: Scores,
    others: Scores,
) -> Iterator[tuple[bool, int, float, int, float]]:
    """Yield for each round whether there is a mate, then its presentation, score, rank and chance.

    Without a mate, it is the presentation of the highest score, -1 where that is not one of the
    test. `of_own` are the scores of presentation `k` with all of the test, `others` with candidates
    of the background. So many fingers or subjects are `among` those searched in each of the rounds.
    """
    others = np.sort(others)[::-1][:LIST_LENGTH]
    for turn, groups in enumerate(rounds):
        if not roles.is_searched(k, turn):
            continue
        for enrolled, searched in zip(groups, among[turn], strict=True):
            is_mate = roles.subject[enrolled] == roles.subject[k]
            if k in enrolled[is_mate]:
                continue  # it is enrolled itself: its subject has no other presentation
            listed = of_own[enrolled[~is_mate]]
            rivals = np.concatenate([listed[listed > NO_SCORE], others])
            if not is_mate.any():
                highest = rivals.max(initial=NO_SCORE)
                is_first = (listed == highest) & (highest > NO_SCORE)
                first = int(enrolled[np.argmax(is_first)]) if is_first.any() else -1
                chance = expected_by_chance(rivals, searched).min(initial=NO_CHANCE)
                yield False, first, float(highest), 1, float(chance)
                continue
            mate = int(enrolled[is_mate][0])
            of_mate = float(of_own[mate])
            rank = min(int(np.count_nonzero(rivals >= of_mate)) + 1, NOT_LISTED)
            if of_mate <= NO_SCORE or rank == NOT_LISTED:
                yield True, mate, NO_SCORE, NOT_LISTED, NO_CHANCE
                continue
            chance = expected_by_chance([of_mate, *rivals], searched)[0]
            yield True, mate, of_mate, rank, float(chance)
