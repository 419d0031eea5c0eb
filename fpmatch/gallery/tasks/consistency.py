"""Consistency of fingers: whether the impressions of each, enrolled and new, match each other."""

from __future__ import annotations

import math
from itertools import chain, combinations
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.fingers.finger import choose_impressions
from fpmatch.gallery.store.audit import ranges
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.decision import find_reachable, find_shortage
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.listing.entry import Entry, Label
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

LINK_SCORE: Final = 30.0
HIGHEST_LINK_SCORE: Final = 55.0
MOST_COMPARED: Final = 8  # impressions of a finger that a new one is compared with


def check_fingers(
    gallery: Gallery, *, subject: str | None = None, progress: Progress = no_progress
) -> Iterator[dict[str, Any]]:
    """Compare the impressions of each finger with each other; yield fingers by first entry.

    A finger is an object of JSON: its "subject" and "finger"; "groups" of numbers of impressions
    that match each other, the largest first; if it is "consistent", of one group; and
    "disagreements", the best-scoring pair of each further group and the first.

    Small touches of one finger that share no skin do not match either: two groups are a reason to
    inspect them, no proof. Two impressions match from a score of 30, or of more, up to 55, where
    they form many pairs. Of more than 64 impressions, all are compared with 64 spread over them.
    Fingers with one impression are left out, and damaged entries.

    Only fingers of a `subject` are checked (default: all). `progress` is called with stage "check"
    and numbers of impressions. Raises GalleryError if the gallery cannot be read.
    """
    matcher, curve = get_matcher(DEFAULT_MATCHER), load_calibration(DEFAULT_MATCHER)
    fingers: dict[Label, list[int]] = {}
    for entry in gallery.entries(subject=subject):
        fingers.setdefault(entry.label.of_finger, []).append(entry.id)
    several = {label: numbers for label, numbers in fingers.items() if len(numbers) > 1}
    done, total = 0, sum(map(len, several.values()))
    progress("check", 0, total)
    gallery.record("check", entries=ranges(chain.from_iterable(several.values())))
    for label, numbers in several.items():
        sound = dict(gallery.templates(of=numbers))
        if len(sound) > 1:
            checked = _check(sound, matcher, curve)
            yield {"subject": label.subject, "finger": label.finger, **checked}
        done += len(numbers)
        progress("check", done, total)


def find_damaged(
    gallery: Gallery, *, subject: str | None = None, progress: Progress = no_progress
) -> dict[int, str]:
    """Read all entries of a gallery, or of a subject; return why some are damaged, by number.

    `progress` is called with stage "read" and numbers of entries. Raises GalleryError if the
    gallery cannot be read.
    """
    numbers = None if subject is None else gallery.numbers_of(subject)
    total = len(gallery if numbers is None else numbers)
    for done, _ in enumerate(gallery.packed_entries(of=numbers), start=1):
        progress("read", min(done, total), total)
    damaged = gallery.damaged.items()
    return {number: why for number, why in damaged if numbers is None or number in numbers}


def find_unmatched(
    gallery: Gallery,
    label: Label,
    template: Template,
    existing: Sequence[Entry],
    earlier: Sequence[tuple[Label, Template]] = (),
) -> str | None:
    """Return why a print matches none of up to eight impressions of its finger; None if it does.

    `existing` are the entries of its subject; `earlier` are prints of its finger that are enrolled
    together with it.
    """
    same = {one.id: one.label for one in existing if one.label.of_finger == label.of_finger}
    stored = gallery.templates(of=[*same][-MOST_COMPARED:])
    others = [*((same[number], other) for number, other in stored), *earlier][-MOST_COMPARED:]
    if not others:
        return None
    matcher, curve = get_matcher(DEFAULT_MATCHER), load_calibration(DEFAULT_MATCHER)
    sides = [template, *(other for _, other in others)]
    probe, *references = [(side, matcher.prepare(side)) for side in sides]
    for reference in references:
        if curve.score(matcher.compare(probe[1], reference[1]).similarity) >= LINK_SCORE:
            return None
    known = find_reachable(matcher, curve, probe, references)
    lacking = find_shortage(matcher, curve, known, LINK_SCORE)
    why = "another finger, or other skin of it" if lacking is None else lacking.message
    verb = "does not match" if lacking is None else "cannot be compared with"
    more = f" or {len(others) - 1} other impressions" if len(others) > 1 else ""
    return f"{label} {verb} {others[0][0]}{more}: {why}"


def _check(sound: Mapping[int, Template], matcher: Matcher, curve: Calibration) -> dict[str, Any]:
    """Return the groups of readable impressions of a finger that matches link."""
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415  (slow to import)

    numbers = list(sound)
    prepared = [matcher.prepare(template) for template in sound.values()]
    among = set(choose_impressions(len(numbers)))
    scores = np.zeros((len(numbers), len(numbers)))
    for i, j in combinations(range(len(numbers)), 2):
        if i in among or j in among:
            similarity = matcher.compare(prepared[i], prepared[j]).similarity
            scores[i, j] = scores[j, i] = curve.score(similarity)
    # it grows with the pairs, one false match of which would join two fingers
    least = LINK_SCORE + 10.0 * math.log10(len(sound) * (len(sound) - 1) / 2)
    linked = scores >= min(least, HIGHEST_LINK_SCORE)
    _, label = connected_components(linked, directed=False)
    groups = [np.flatnonzero(label == k).tolist() for k in range(max(label) + 1)]
    groups.sort(key=lambda group: (-len(group), group[0]))
    disagreements = []
    for group in groups[1:]:
        between = scores[np.ix_(groups[0], group)]
        row, column = np.unravel_index(between.argmax(), between.shape)
        ids = [numbers[groups[0][row]], numbers[group[column]]]
        disagreements.append({"ids": ids, "score": float(between[row, column])})
    return {
        "consistent": len(groups) == 1,
        "groups": [[numbers[k] for k in group] for group in groups],
        "disagreements": disagreements,
    }
