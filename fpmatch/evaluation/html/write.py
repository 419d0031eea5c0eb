"""Write an evaluation as one page that needs nothing beside it, and no network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.errors import OutputError
from fpmatch.evaluation.html import sections
from fpmatch.evaluation.html.markup import Html, element, joined, text
from fpmatch.evaluation.html.style import stylesheet
from fpmatch.evaluation.html.svg import check_matplotlib
from fpmatch.output import atomic_write_bytes, check_writable, reason

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from fpmatch.evaluation.analysis import Analysis
    from fpmatch.evaluation.run_comparison_result import PairedComparison

PAGE_NAME: Final = "index.html"
_TITLE: Final = "fpmatch: error rates"


def prepare_page(folder: str | os.PathLike[str]) -> Path:
    """Make the folder of a page, and refuse early what would fail late.

    Parameters
    ----------
    folder : path
        The folder; made if missing.

    Returns
    -------
    Path
        The file that `write_page` will write.

    Raises
    ------
    OutputError
        If matplotlib is not installed, or the page cannot be written there.
    """
    check_matplotlib()
    target = Path(folder) / PAGE_NAME
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: no folder can be made: {reason(error)}") from error
    check_writable(target)
    return target


def write_page(
    folder: str | os.PathLike[str],
    analyses: Sequence[Analysis],
    comparisons: Sequence[PairedComparison] = (),
) -> Path:
    """Write the page: the same evaluation gives the same bytes but for the times measured.

    Parameters
    ----------
    folder : path
        Where; made if missing. An older page there is replaced.
    analyses : sequence of Analysis
        One a matcher, over the same databases, whose images are read again for the overlays.
    comparisons : sequence of PairedComparison
        Those of the first matcher with the others.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OutputError
        As `prepare_page`.
    """
    target = prepare_page(folder)
    atomic_write_bytes(target, page(analyses, comparisons).encode("utf-8"))
    return target


def page(analyses: Sequence[Analysis], comparisons: Sequence[PairedComparison] = ()) -> str:
    """Return the HTML that `write_page` writes."""
    parts = [sections.heading(analyses)]
    if len(analyses) > 1:
        parts.append(sections.side_by_side(analyses, comparisons))
    parts += [sections.matcher_section(one, number) for number, one in enumerate(analyses)]
    parts += [sections.failures(analyses[0].report), sections.glossary()]
    head = element(
        "head",
        Html('<meta charset="utf-8">'),
        Html('<meta name="viewport" content="width=device-width, initial-scale=1">'),
        element("title", text(_TITLE)),
        element("style", Html(stylesheet())),
    )
    body = element("body", element("main", joined(parts)))
    return f"<!DOCTYPE html>\n{element('html', head, body, lang='en')}\n"
