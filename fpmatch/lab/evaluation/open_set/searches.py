"""The searches of an open-set test: the score of the mate and its rank, or the highest score.

Each presentation is searched for once, in a gallery of all presentations and the background. A
presentation that is not enrolled in a round is then left out of the candidates of this round. In a
gallery that is compared as a whole this changes nothing. In a larger one, pre-selection chooses a
few prints less of the background than it would.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.fingers.fused_fingers import fuse_fingers
from fpmatch.gallery.index.loss import EXHAUSTIVE_UP_TO
from fpmatch.gallery.search.fused import identify_fused
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.whole import WholeSearch
from fpmatch.lab.evaluation.open_set.roles import EnrolledSubjects

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.search.search import Search
    from fpmatch.lab.evaluation.open_set.roles import Roles
    from fpmatch.matching.calibration import Calibration
    from fpmatch.templates.minutiae import Template

    Presentation = tuple[Template | None, ...]
    Scores = NDArray[np.float64]

LIST_LENGTH: Final = 100  # candidates of a search
NOT_LISTED: Final = LIST_LENGTH + 1
NO_SCORE: Final = -1.0  # below every score: the mate is not listed, or there is no candidate


@dataclass(frozen=True, slots=True, eq=False)
class Searches:
    """The outcomes of all searches.

    Of searches with a mate, M, `mate` is its presentation, `score` and `rank` are its score and
    rank, ties counting against it, and `direct` is the score of comparing both 1:1. Of the others,
    L, `highest` is the highest score, and `first` the presentation that has it, -1 where that is
    not one of the test. `mated` and `nonmated` hold what was searched for. `enrolled` holds the
    number of subjects in the gallery of each round, `compared` that of their scores: one a finger,
    or one a subject where several fingers are fused.
    """

    mated: NDArray[np.intp]
    mate: NDArray[np.intp]
    score: Scores
    rank: NDArray[np.intp]
    direct: Scores
    nonmated: NDArray[np.intp]
    highest: Scores
    first: NDArray[np.intp]
    enrolled: NDArray[np.intp]
    compared: NDArray[np.intp]
    preselected: bool

    def of(self, which: NDArray[np.bool_]) -> Searches:
        """Return the searches for some of the presentations."""
        mated, nonmated = which[self.mated], which[self.nonmated]
        return replace(
            self,
            mated=self.mated[mated],
            mate=self.mate[mated],
            score=self.score[mated],
            rank=self.rank[mated],
            direct=self.direct[mated],
            nonmated=self.nonmated[nonmated],
            highest=self.highest[nonmated],
            first=self.first[nonmated],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """A search of prints without mates, with the subject and the finger of each.

    Subjects are numbered from 0, fingers of a subject likewise; as for `EnrolledSubjects`.
    """

    search: Search
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
        self.own = WholeSearch.of(templates, background.search.matcher)
        self.search = background.search.with_prints(templates) if self.first else self.own
        self.places = np.full((len(presentations), len(presentations[0])), -1)
        for place, (k, f, _) in enumerate(impressions):
            self.places[k, f] = place
        subject, finger = np.array([(k, f) for k, f, _ in impressions], np.intp).reshape(-1, 2).T
        self.subjects = EnrolledSubjects(
            self.search.numbers,
            np.concatenate([background.subject, subject + self.first]),
            np.concatenate([background.finger, finger]),
        )
        self.calibration = calibration
        others = len(presentations) if len(self.search) <= EXHAUSTIVE_UP_TO else LIST_LENGTH
        self.options = options | {"calibration": calibration, "count": LIST_LENGTH + others}
        self.options["all_mates"] = True  # all impressions are searched at once
        self.options["workers"] = 1  # the engine uses all cores already

    def candidates(self, presentation: int) -> tuple[NDArray[np.intp], Scores, bool]:
        """Return subjects and scores of the candidates, and whether there was a pre-selection."""
        shown = [(k, t) for k, t in enumerate(self.presentations[presentation]) if t is not None]
        if not shown:
            return np.empty(0, np.intp), np.empty(0), False
        if len(self.presentations[presentation]) == 1:
            alone = identify(
                self.search, shown[0][1], subject_of=self.subjects.subject_of, **self.options
            )
            listed = [(self.subjects.subject_of(c.number), c.score) for c in alone.candidates]
            preselected = alone.preselected
        else:
            probes, positions = [t for _, t in shown], [str(k) for k, _ in shown]
            fused = identify_fused(
                self.search, probes, self.subjects, positions=positions, **self.options
            )
            listed = [(c.subject, c.score) for c in fused.candidates]
            preselected = fused.preselected
        subject = np.array([int(name or -1) for name, _ in listed], np.intp)
        return subject, np.array([score for _, score in listed]), preselected

    def direct(self, presentation: int, others: NDArray[np.intp]) -> Scores:
        """Return the scores of comparing a presentation 1:1 with others."""
        prepare = self.search.matcher.prepare
        scores = np.full((len(others), len(self.presentations[0])), np.nan)
        for f, template in enumerate(self.presentations[presentation]):
            places = self.places[others, f]
            if template is not None and (places >= 0).any():
                which = places[places >= 0]
                similarities = self.own.similarities(prepare(template), which)
                scores[places >= 0, f] = self.calibration.scores(similarities)
        return np.array(
            [
                float(fuse_fingers(row[~np.isnan(row)])) if not np.isnan(row).all() else NO_SCORE
                for row in scores
            ]
        )


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
    mated, nonmated, preselected = [], [], False
    for k in range(len(presentations)):
        progress("search", k, len(presentations))
        subject, score, of_list = gallery.candidates(k)
        preselected |= of_list
        mates = np.flatnonzero(roles.subject == roles.subject[k])
        direct = dict(zip(mates.tolist(), gallery.direct(k, mates), strict=True))
        for has_mate, other, of_other, rank in _outcomes(k, roles, rounds, gallery, subject, score):
            if has_mate:
                mated.append((k, other, of_other, rank, direct[other]))
            else:
                nonmated.append((k, other, of_other))
    progress("search", len(presentations), len(presentations))
    of_round = np.array([len(enrolled) for turn in rounds for enrolled in turn])
    one_finger = len(presentations[0]) == 1
    with_mate, without = np.array(mated).reshape(-1, 5), np.array(nonmated).reshape(-1, 3)
    return Searches(
        mated=with_mate[:, 0].astype(np.intp),
        mate=with_mate[:, 1].astype(np.intp),
        score=with_mate[:, 2],
        rank=with_mate[:, 3].astype(np.intp),
        direct=with_mate[:, 4],
        nonmated=without[:, 0].astype(np.intp),
        first=without[:, 1].astype(np.intp),
        highest=without[:, 2],
        enrolled=gallery.first + of_round,
        compared=of_round + (len(background.search.finger_sizes) if one_finger else gallery.first),
        preselected=preselected,
    )


def _outcomes(
    k: int,
    roles: Roles,
    rounds: Sequence[Sequence[NDArray[np.intp]]],
    gallery: _Gallery,
    subject: NDArray[np.intp],
    score: Scores,
) -> Iterator[tuple[bool, int, float, int]]:
    """Yield for each round whether there is a mate, then presentation, score and rank of the mate.

    Without a mate, it is the presentation of the highest score, -1 where that is not one of the
    test. `subject` and `score` describe the candidates of presentation `k`.
    """
    own = subject >= gallery.first
    others = np.sort(score[~own])[::-1][:LIST_LENGTH]
    of_own = np.full(len(roles.subject), NO_SCORE)
    of_own[subject[own] - gallery.first] = score[own]
    for turn, groups in enumerate(rounds):
        if not roles.is_searched(k, turn):
            continue
        for enrolled in groups:
            is_mate = roles.subject[enrolled] == roles.subject[k]
            if k in enrolled[is_mate]:
                continue  # it is enrolled itself: its subject has no other presentation
            listed = of_own[enrolled[~is_mate]]
            if not is_mate.any():
                highest = max(listed.max(initial=NO_SCORE), others.max(initial=NO_SCORE))
                is_first = (listed == highest) & (highest > NO_SCORE)
                first = int(enrolled[np.argmax(is_first)]) if is_first.any() else -1
                yield False, first, float(highest), 1
                continue
            mate = int(enrolled[is_mate][0])
            of_mate = float(of_own[mate])
            before = int(np.count_nonzero(listed >= of_mate) + np.count_nonzero(others >= of_mate))
            rank = min(before + 1, NOT_LISTED)
            if of_mate <= NO_SCORE or rank == NOT_LISTED:
                rank, of_mate = NOT_LISTED, NO_SCORE
            yield True, mate, of_mate, rank
