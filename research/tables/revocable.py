"""The tables of the page on revocable templates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

_RATES: Final = (("EER", "eer"), ("FMR100", "fmr100"), ("FMR1000", "fmr1000"))


def format_revocable(results: Mapping[str, Any]) -> str:
    """Return error rates, linkability and costs as Markdown."""
    found = results["measured"]
    names = [name for name, _ in _RATES]
    lines = [
        f"| database | revocable: {' / '.join(names)} | minutiae and ridges: {' / '.join(names)} |",
        "|---|---|---|",
        *(
            f"| {one['name']} | {_rates(one['revocable'])} | {_rates(one['minutiae'])} |"
            for one in found["sets"]
        ),
        f"| **mean** | {_mean(found['sets'], 'revocable')} | {_mean(found['sets'], 'minutiae')} |",
        "",
        "| templates of two keys, judged by | no key known: D_sys / largest by chance / EER "
        "| one key known |",
        "|---|--:|--:|",
        *(
            f"| {one['attack']} | {_linked(one['unknown'])} | {_linked(one['known'])} |"
            for one in found["linkability"]
        ),
        "",
        *_dictionary(found["dictionary"]),
        "",
        f"A template has {found['bytes']:,} bytes. In units of scipy's Delaunay of 40 points, a "
        f"comparison takes {found['compare_ratio']:.1f}, making a template "
        f"{found['protect_ratio']:.0f}.",
    ]
    return "\n".join(lines)


def _linked(one: Mapping[str, float] | None) -> str:
    if one is None:
        return ""
    return f"{one['d_sys']:.3f} / {one['by_chance']:.3f} / {100 * one['eer']:.1f}"


def _dictionary(found: Mapping[str, Any]) -> list[str]:
    known, unknown, cells = found["known"], found["unknown"], found["all_cells"]
    return [
        "| dictionary | key known | key unknown | by chance |",
        "|---|--:|--:|--:|",
        f"| all {cells['cells']:,} cells, tried with {cells['templates']:,} templates in "
        f"{cells['seconds']:.0f} s on one core: share of what it finds that is of the print "
        f"| {100 * cells['right']:.0f} % | none | |",
        f"| {found['strangers']:,} templates of other fingers: share of the prints that one of "
        f"them matches at FMR {100 * found['fmr']:g} % "
        f"| {100 * known['match']:.1f} % | {100 * unknown['match']:.1f} % | |",
        f"| the other prints of the database: the most similar one is of the finger "
        f"| {100 * known['nearest']:.1f} % | {100 * unknown['nearest']:.1f} % "
        f"| {100 * known['chance']:.1f} % |",
    ]


def _rates(rates: Mapping[str, float | None]) -> str:
    cells = [rates[key] for _, key in _RATES]
    return " / ".join("-" if cell is None else f"{100 * cell:.2f}" for cell in cells)


def _mean(sets: list[Mapping[str, Any]], form: str) -> str:
    columns = {key: [one[form][key] for one in sets] for _, key in _RATES}
    return _rates({k: None if None in c else sum(c) / len(c) for k, c in columns.items()})
