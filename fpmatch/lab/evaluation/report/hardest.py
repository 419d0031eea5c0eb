"""The hardest pairs, genuine and impostor, with a picture of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.draw import draw
from fpmatch.drawing.scene.raster import reduced, webp_bytes
from fpmatch.errors import FpmatchError
from fpmatch.matching.verify import verify
from fpmatch.printable import count

if TYPE_CHECKING:
    from fpmatch.lab.evaluation.report.results import RatesReport, SetRates

DEFAULT_COUNT: Final = 6
NO_PAIRS: Final = np.empty(0, np.intp)
_PICTURE_WIDTH: Final = 900


@dataclass(frozen=True, slots=True)
class HardPair:
    """One hard pair; `score` is None where it is not known.

    `note` says what `fpmatch.verify` finds, or why there is no `picture`, a WebP of the overlay,
    which is then empty.
    """

    set_name: str
    probe: str
    reference: str
    similarity: float
    score: float | None = None
    note: str = ""
    picture: bytes = b""


def hardest_pairs(
    report: RatesReport, count: int = DEFAULT_COUNT, *, genuine: bool
) -> list[HardPair]:
    """Find the genuine pairs least similar, or the impostor pairs most similar, and draw them.

    The hardest come first. Each print comes once, so that one bad print does not fill the list;
    pairs with a print that gave no template are left out. The images must still be there; of scores
    from a file, the pairs are only named.
    """
    every = report.scores
    usable = [
        np.flatnonzero((one.trials.genuine == genuine) & one.compared) if one.prints else NO_PAIRS
        for one in every
    ]
    places = [(n, k) for n, pairs in enumerate(usable) for k in pairs.tolist()]
    similarity = np.concatenate(
        [one.trials.similarity[pairs] for one, pairs in zip(every, usable, strict=True)]
    )
    hardest: list[HardPair] = []
    seen: set[tuple[int, int]] = set()
    for n in np.argsort(similarity if genuine else -similarity, kind="stable"):
        of, k = places[n]
        sides = {(of, int(every[of].probe[k])), (of, int(every[of].reference[k]))}
        if seen.isdisjoint(sides):
            seen |= sides
            hardest.append(_hard_pair(report.matcher, report.sets[of], k))
        if len(hardest) >= count:
            break
    return hardest


def _hard_pair(matcher: str, row: SetRates, k: int) -> HardPair:
    """Return a pair of a database, drawn where its prints are known."""
    scores = row.scores
    probe, reference = (scores.prints[side[k]] for side in (scores.probe, scores.reference))
    similarity = float(scores.trials.similarity[k]) * (-1 if scores.distances else 1)
    named = scores.name, probe, reference, similarity
    if row.source is None:
        return HardPair(*named)
    try:
        prints = [row.source.read(name) for name in (probe, reference)]
        v = verify(*(template for template, _ in prints), matcher=matcher)
        drawn = draw(prints[0][1], prints[1][1], v)
    except FpmatchError as error:  # not a matcher of the package, or not calibrated
        return HardPair(*named, note=f"not drawn: {error}")
    note = f"{count(len(v.pairs), 'pair')} of minutiae, overlap {v.overlap:.0%}"
    note += f"; {v.reason}" if v.reason else ""
    picture = webp_bytes(reduced(drawn, width=_PICTURE_WIDTH, height=drawn.shape[0]))
    return HardPair(*named, v.score, note, picture)
