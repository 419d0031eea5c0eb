"""The hardest pairs, genuine and impostor, with their likely causes and a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.draw import draw
from fpmatch.drawing.scene.ink import ridge_picture
from fpmatch.drawing.scene.raster import reduced, webp_bytes
from fpmatch.errors import FpmatchError, MatcherError
from fpmatch.image.io.read import read_image
from fpmatch.image.quality.polarity import INVERTED
from fpmatch.lab.evaluation.report.results import SetResult
from fpmatch.matching.verify import verify
from fpmatch.printable import count
from fpmatch.prints.reading import content_of
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.image.io.read import GreyImage
    from fpmatch.lab.evaluation.databases.extraction import Extraction
    from fpmatch.lab.evaluation.databases.protocol import Impression
    from fpmatch.lab.evaluation.rates.scores_set import ScoresSet
    from fpmatch.lab.evaluation.report.results import RatesReport
    from fpmatch.matching.verify import Verification


DEFAULT_COUNT: Final = 6
NO_PAIRS: Final = np.empty(0, np.intp)
_PICTURE_WIDTH: Final = 900

# Bounds of what is named as a likely cause.
FEW_MINUTIAE: Final = 20
SMALL_OVERLAP: Final = 0.5  # of the smaller print
LOW_AGREEMENT: Final = 0.4  # share of the minutiae in the overlap that are paired
POOR_QUALITY: Final = 35.0  # median over the minutiae, 0 to 100
STRETCHED_PX: Final = 5.0  # rms residual of the pairs at 500 dpi
ODD_ROTATION_DEG: Final = 60.0
ODD_SCALE: Final = 1.07  # beyond that of the resolutions


@dataclass(frozen=True, slots=True)
class HardPair:
    """One hard pair; `score` is None where the matcher has no calibration.

    `picture` is a WebP of the overlay, empty where there is none.
    """

    set_name: str
    probe: str
    reference: str
    score: float | None
    similarity: float
    causes: tuple[str, ...]
    picture: bytes


def hardest_pairs(
    report: RatesReport, count: int = DEFAULT_COUNT, *, genuine: bool
) -> list[HardPair]:
    """Find the genuine pairs least similar, or the impostor pairs most similar, and draw them.

    The hardest come first. Each print comes once, so that one bad print does not fill the list;
    pairs with a print that gave no template are left out. The images must still be there; of scores
    without images, the pairs are only named.
    """
    every = [row.scores for row in report.sets]
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
            row = report.sets[of]
            explained = (
                _explained(report, row, k, genuine=genuine)
                if isinstance(row, SetResult)
                else _named(row.scores, k)
            )
            hardest.append(explained)
        if len(hardest) >= count:
            break
    return hardest


def _named(scores: ScoresSet, k: int) -> HardPair:
    """Return a pair of which only the scores are known."""
    similarity = float(scores.trials.similarity[k])
    return HardPair(
        set_name=scores.name,
        probe=scores.prints[scores.probe[k]],
        reference=scores.prints[scores.reference[k]],
        score=None,
        similarity=-similarity if scores.distances else similarity,
        causes=(),
        picture=b"",
    )


def _explained(report: RatesReport, row: SetResult, k: int, *, genuine: bool) -> HardPair:
    impressions, extractions = row.extracted.dataset.impressions, row.extracted.extractions
    pair = [(impressions[m], extractions[m]) for m in (row.pairs.probe[k], row.pairs.reference[k])]
    similarity = float(row.outcomes["similarity"][k])
    return explained_pair(report.matcher, row.name, pair, similarity, genuine=genuine)


def explained_pair(
    matcher: str,
    set_name: str,
    pair: Sequence[tuple[Impression, Extraction]],
    similarity: float,
    *,
    genuine: bool,
) -> HardPair:
    """Compare two prints, each with a template, and return them with likely causes and a picture.

    `similarity` is that of the test.
    """
    probe, reference = (extraction.template for _, extraction in pair)
    assert probe is not None
    assert reference is not None
    score, picture = None, b""
    try:
        verification = verify(probe, reference, matcher=matcher)
    except MatcherError as error:  # not one of the package's, or not calibrated
        causes: tuple[str, ...] = (f"not drawn: {error}",)
    else:
        score = verification.score
        explain = explain_false_non_match if genuine else explain_false_match
        causes = explain(verification)
        try:
            picture = _picture(verification, *(_as_extracted(*side) for side in pair))
        except FpmatchError as error:
            causes = (*causes, f"not drawn: {error}")
    return HardPair(
        set_name=set_name,
        probe=pair[0][0].name,
        reference=pair[1][0].name,
        score=score,
        similarity=similarity,
        causes=causes,
        picture=picture,
    )


def _as_extracted(impression: Impression, extraction: Extraction) -> GreyImage | NDArray[np.uint8]:
    """Read an image with the polarity with which its template was extracted.

    Of a template that was stored, the ridges are drawn.
    """
    path, template = impression.path, extraction.template
    if template is not None and (impression.entry is not None or content_of(path) == "template"):
        return ridge_picture(template)
    return read_image(path, polarity="white" if INVERTED in extraction.notes else "dark")


def _picture(
    verification: Verification,
    probe: GreyImage | NDArray[np.uint8],
    reference: GreyImage | NDArray[np.uint8],
) -> bytes:
    drawn = draw(probe, reference, verification)
    return webp_bytes(reduced(drawn, width=_PICTURE_WIDTH, height=drawn.shape[0]))


def explain_false_non_match(verification: Verification) -> tuple[str, ...]:
    """Return likely causes of a low score of two prints of one finger, as short phrases."""
    v = verification
    causes = _poor_prints(v)
    if v.reason:
        causes.append(v.reason)
    if v.transform is None:
        return tuple(causes)
    odd = _odd_placement(v)
    if odd:  # measures under a wrong placement do not describe the prints
        return (*causes, *(f"placed wrongly, it seems: {words}" for words in odd))
    if v.overlap < SMALL_OVERLAP:
        causes.append(f"as placed they overlap by only {v.overlap:.0%} of the smaller print")
    if v.agreement < LOW_AGREEMENT:
        causes.append(
            f"only {v.agreement:.0%} of the minutiae in the overlap are paired: "
            "found in one print and not in the other, or wrongly placed"
        )
    causes += _stretch(v)
    return tuple(causes) or (f"{count(len(v.pairs), 'pair')} of minutiae; nothing stands out",)


def explain_false_match(verification: Verification) -> tuple[str, ...]:
    """Return evidence for and against prints of different fingers with a high score."""
    v = verification
    evidence = [
        f"{count(len(v.pairs), 'pair')}, {v.agreement:.0%} of the minutiae where they overlap, "
        "agree by chance"
    ]
    if v.overlap < SMALL_OVERLAP:
        evidence.append(
            f"they overlap by only {v.overlap:.0%} of the smaller print, which leaves little "
            "to disagree"
        )
    odd = [f"only {words}" for words in _odd_placement(v)]
    return (*evidence, *_stretch(v), *odd, *_poor_prints(v))


def _poor_prints(v: Verification) -> list[str]:
    poor = []
    for name, side in (("probe", v.probe), ("reference", v.reference)):
        if len(side.minutiae) < FEW_MINUTIAE:
            few = count(len(side.minutiae), "minutia", "minutiae")
            poor.append(f"the {name} has only {few}")
        elif (quality := float(np.median(side.minutiae.quality))) < POOR_QUALITY:
            poor.append(f"the {name} is poor: its minutiae have a median quality of {quality:.0f}")
    return poor


def _stretch(v: Verification) -> list[str]:
    at_500_dpi = v.rms_px * STANDARD_DPI / v.reference.dpi
    if math.isfinite(at_500_dpi) and at_500_dpi > STRETCHED_PX:
        return [f"the pairs lie {at_500_dpi:.1f} px (rms, at 500 dpi) off each other"]
    return []


def _odd_placement(v: Verification) -> list[str]:
    if v.transform is None:
        return []
    odd = []
    if abs(v.transform.rotation_deg) > ODD_ROTATION_DEG:
        odd.append(f"after a turn by {abs(v.transform.rotation_deg):.0f}°")
    factor = v.transform.scale * v.probe.dpi / v.reference.dpi
    if max(factor, 1 / factor) > ODD_SCALE:
        odd.append(f"after a change of size by {factor - 1:+.0%}")
    return odd
