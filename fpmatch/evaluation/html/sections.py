"""The sections of the page, in their order."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch._version import __version__
from fpmatch.evaluation.decision import decide, rho_of
from fpmatch.evaluation.html.markup import (
    Html,
    bullets,
    element,
    joined,
    paragraph,
    picture,
    text,
)
from fpmatch.evaluation.html.plots import matcher_plots, pooled_curve, pooled_plots
from fpmatch.evaluation.html.tables import matchers_table, paired_table, rate_table
from fpmatch.evaluation.html.worst import WorstPair, worst_genuine, worst_impostors
from fpmatch.matching.calibration import calibrated_matchers
from fpmatch.matching.verify import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.evaluation.analysis import Analysis
    from fpmatch.evaluation.report import EvaluationReport
    from fpmatch.evaluation.run_comparison_result import PairedComparison

_PROTOCOLS: Final = {
    "extended": "every two impressions of different fingers",
    "fvc": "the first impressions of every two different fingers",
}
_MOST_FAILURES: Final = 50
_WORDS: Final = (
    "FMR: false match rate, the share of impostor pairs that match. FNMR: false non-match rate, "
    "the share of genuine pairs that do not.",
    "EER: where both are equal. FMR100, FMR1000, FMR10000: the FNMR at the threshold where one "
    "impostor pair in 100, 1,000, 10,000 matches. ZeroFMR: the same where none does. ZeroFNMR: the "
    "FMR where no genuine pair is rejected. “-”: too few pairs.",
    "rank-1: each print is searched among all other prints of its database; a finger counts by "
    "its most similar impression, and a tie against the print’s own.",
    "Small print below a rate: its 95 % interval, from drawing the fingers of each database anew, "
    "with replacement. It says how far the rate would scatter with other fingers before the same "
    "sensor; where no error was seen it cannot say how many there are.",
    "failed: images that gave no template (failures to enrol). They score 0 in all their pairs.",
)


def heading(analyses: Sequence[Analysis]) -> Html:
    """Return what was done: databases, prints, protocol."""
    report = analyses[0].report
    prints = sum(row.prints for row in report.sets)
    fingers = sum(len({i.finger for i in r.extracted.dataset.impressions}) for r in report.sets)
    genuine = sum(row.genuine for row in report.sets)
    impostor = sum(row.impostor for row in report.sets)
    names = ", ".join(one.report.matcher for one in analyses)
    matchers = "matcher" if len(analyses) == 1 else "matchers"
    return joined(
        [
            element("h1", text("Fingerprint verification: error rates")),
            paragraph(
                f"{_counted(len(report.sets), 'database')}, {prints:,} prints of {fingers} "
                f"fingers; {matchers} {names}. Compared were {genuine:,} genuine pairs, all there "
                f"are, and {impostor:,} impostor pairs: {_PROTOCOLS[report.protocol]} "
                f"(protocol {report.protocol})."
            ),
            paragraph(f"Made by fpmatch {__version__}.", class_="note"),
        ]
    )


def side_by_side(analyses: Sequence[Analysis], comparisons: Sequence[PairedComparison]) -> Html:
    """Return the matchers beside each other, and what sets the others off from the first."""
    curves = [pooled_curve(one.report, one.report.matcher) for one in analyses]
    first = analyses[0].report.matcher
    parts = [
        element("h2", text("Matchers side by side")),
        matchers_table(analyses),
        *pooled_plots(curves),
    ]
    for comparison in comparisons:
        parts.append(element("h3", text(f"{comparison.now} against {first}, pair by pair")))
        parts.append(paired_table(comparison))
    return joined(parts)


def matcher_section(analysis: Analysis, number: int) -> Html:
    """Return everything about one matcher; `number` tells its plots from another's."""
    report = analysis.report
    parts = [
        element("h2", text(f"Matcher {report.matcher}")),
        *_at_default_threshold(report),
        rate_table(analysis),
        *matcher_plots(report, number),
    ]
    if analysis.baseline is not None:
        parts += [
            element("h3", text(f"Compared with {analysis.baseline_name}")),
            paragraph(
                f"{analysis.baseline.pooled.pairs:,} pairs are in both, "
                f"{analysis.baseline.alike:,} of them with the same similarity.",
                class_="note",
            ),
            paired_table(analysis.baseline),
            *_decisions(analysis.baseline),
        ]
    parts += _worst_pairs(report)
    return joined(parts)


def _at_default_threshold(report: EvaluationReport) -> list[Html]:
    """Return what a user of `verify` would have seen."""
    rho = rho_of(report.matcher)
    if rho is None and report.matcher not in calibrated_matchers():
        return []
    pooled = pooled_curve(report)
    missed = int((~decide(report.matcher, pooled.genuine)).sum())
    matched = int(decide(report.matcher, pooled.impostor).sum())
    rule = (
        f"At the default threshold of {DEFAULT_THRESHOLD:g}"
        if rho is None
        else f"Where more than a share rho = {rho:g} of the minutiae must be paired"
    )
    return [
        paragraph(
            f"{rule}, {missed:,} of "
            f"{pooled.genuine.size:,} genuine pairs do not match"
            f"{_share(missed, pooled.genuine.size)}, and {matched:,} of "
            f"{pooled.impostor.size:,} impostor pairs do{_share(matched, pooled.impostor.size)}."
        )
    ]


def _share(count: int, total: int) -> str:
    return f" ({100 * count / total:.3g} %)" if total else ""


def _decisions(comparison: PairedComparison) -> list[Html]:
    d = comparison.decisions
    if d is None:
        return []
    words = d.in_words()
    said = paragraph(f"{words[0].upper()}{words[1:]}.")
    named = [
        f"{label}: {pair.set_name} {pair.probe} {pair.reference}"
        for label, pairs in (("now matching", d.gained), ("no longer", d.lost))
        for pair in pairs
    ]
    if not named:
        return [said]
    shown = element("summary", text("Which"))
    return [said, element("details", shown, bullets(named))]


def _worst_pairs(report: EvaluationReport) -> list[Html]:
    return [
        element("h3", text("Genuine pairs least alike")),
        paragraph(
            "The same finger twice, the lowest scores first; each print is shown once. The probe "
            "is blue, the reference orange, ridges that agree are dark. A click enlarges.",
            class_="note",
        ),
        _cards(worst_genuine(report)),
        element("h3", text("Impostor pairs most alike")),
        paragraph("Different fingers, the highest scores first.", class_="note"),
        _cards(worst_impostors(report)),
    ]


def failures(report: EvaluationReport) -> Html:
    """Return the images that gave no template."""
    failed = [reason for row in report.sets for _, reason in row.failures]
    prints = sum(row.prints for row in report.sets)
    title = element("h2", text("Failures to enrol"))
    if not failed:
        return joined([title, paragraph(f"None: all {prints:,} prints gave a template.")])
    said = paragraph(f"{len(failed):,} of {prints:,} prints gave no template.")
    rest = len(failed) - _MOST_FAILURES
    listed = [*failed[:_MOST_FAILURES], *([f"and {rest:,} more"] if rest > 0 else [])]
    return joined([title, said, bullets(listed)])


def glossary() -> Html:
    """Return what the words mean."""
    return joined([element("h2", text("How to read this page")), bullets(_WORDS)])


def _cards(pairs: Sequence[WorstPair]) -> Html:
    return element("div", *map(_card, pairs), class_="worst")


def _card(pair: WorstPair) -> Html:
    measured = (
        f"similarity {pair.similarity:.3g}" if pair.score is None else f"score {pair.score:.1f}"
    )
    named = f"{pair.set_name}: {pair.probe} and {pair.reference}"
    caption = element(
        "figcaption",
        element("b", text(f"{named}, {measured}")),
        bullets(pair.causes),
    )
    shown = [picture(pair.picture, f"overlay of {named}")] if pair.picture else []
    return element("figure", *shown, caption)


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
