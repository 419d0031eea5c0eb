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
        "| templates of two keys, judged by | D_sys | D_sys of the same values in random order |",
        "|---|--:|--:|",
        *(
            f"| {one['attack']} | {one['d_sys']:.3f} | {one['by_chance']:.3f} |"
            for one in found["linkability"]
        ),
        "",
        f"A template has {found['bytes']:,} bytes. In units of scipy's Delaunay of 40 points, a "
        f"comparison takes {found['compare_ratio']:.1f}, making a template "
        f"{found['protect_ratio']:.0f}.",
    ]
    return "\n".join(lines)


def _rates(rates: Mapping[str, float | None]) -> str:
    cells = [rates[key] for _, key in _RATES]
    return " / ".join("-" if cell is None else f"{100 * cell:.2f}" for cell in cells)


def _mean(sets: list[Mapping[str, Any]], form: str) -> str:
    columns = {key: [one[form][key] for one in sets] for _, key in _RATES}
    return _rates({k: None if None in c else sum(c) / len(c) for k, c in columns.items()})
