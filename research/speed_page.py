"""What was measured of the speed, as the tables of the documentation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

PARTS: Final = ("figures", "before", "now")
"""What the results hold: the figures of scripts/bench, and stages as they were and as they are."""
_TITLES: Final = {
    "extraction": "Stages of an extraction, 388 × 374 pixels at 500 dpi",
    "matching": "Before and after it",
    "process": "One `fpmatch verify` of two images",
}


def format_figures_markdown(figures: Sequence[Mapping[str, Any]]) -> str:
    """Return the figures of `scripts/bench` as a table.

    Parameters
    ----------
    figures : sequence of mapping
        The entries that it wrote.

    Returns
    -------
    str
        Markdown, a row a figure.
    """
    body = [
        [
            figure["name"],
            f"{figure['value']:.3g} {figure['unit']}",
            f"{figure['target'].replace('>=', '≥').replace('<=', '≤')}",
            "yes" if figure["ok"] else "**no**",
            figure["ours"],
            figure["yardstick"],
        ]
        for figure in figures
    ]
    return markdown_table([["", "measured", "target", "met", "ours", "beside"], *body])


def format_stages_markdown(
    before: Mapping[str, Mapping[str, float]], now: Mapping[str, Mapping[str, float]]
) -> str:
    """Return the times of the stages, before and now, as tables.

    Parameters
    ----------
    before, now : mapping
        What ``benchmarks/stages.py --json`` wrote: milliseconds by part and stage.

    Returns
    -------
    str
        Markdown, a table a part.
    """
    tables = []
    for part, title in _TITLES.items():
        body = [
            [name, *(_milliseconds(times[part].get(name)) for times in (before, now))]
            for name in dict.fromkeys([*before[part], *now[part]])
        ]
        if part != "matching":  # whose lines are not steps of one thing
            sums = [_milliseconds(sum(times[part].values())) for times in (before, now)]
            body.append(["together", *sums])
        tables += [f"### {title}", markdown_table([["CPU time", "before", "now"], *body])]
    return "\n\n".join(tables)


def _milliseconds(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.2f} ms" if value < 10 else f"{value:.0f} ms"
