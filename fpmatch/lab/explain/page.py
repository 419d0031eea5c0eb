"""The page of an explanation: a sentence, an equation and a picture a step, and the numbers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.base.folders import write_files
from fpmatch.base.html import page_templates
from fpmatch.errors import OutputError
from fpmatch.lab.plots.style import number
from fpmatch.printable import json_text, printable, printable_lines

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from fpmatch.lab.explain.steps import Step

PAGE, NUMBERS = "index.html", "numbers.json"
OWN_FILE: Final = re.compile(r"index\.html|numbers\.json|\d\d_[a-z_]+\.svg")


def check_folder(folder: str | os.PathLike[str]) -> None:
    """Refuse a folder that holds other files than those of an earlier page."""
    target = Path(folder)
    if target.is_dir():
        for other in sorted(path.name for path in target.iterdir()):
            if not OWN_FILE.fullmatch(other):
                raise OutputError(f"{folder}: holds another file, {other}: name a new folder")


def write_page(
    folder: str | os.PathLike[str],
    title: str,
    verdict: str,
    facts: Sequence[tuple[str, str]],
    steps: Sequence[Step],
    numbers: dict[str, Any],
) -> None:
    """Write pictures, numbers and page, in this order, in place of those of an earlier page."""
    check_folder(folder)
    files = {f"{n:02d}_{step.name}.svg": step.picture for n, step in enumerate(steps, start=1)}
    shown = [(step, name if step.picture else "") for step, name in zip(steps, files, strict=True)]
    kept = {name: picture for name, picture in files.items() if picture is not None}
    numbers = {**numbers, **{step.name: step.numbers for step in steps if step.numbers}}
    kept[NUMBERS] = (json_text(numbers, indent=None) + "\n").encode()
    templates = page_templates("fpmatch.lab.explain")
    templates.filters["number"] = number
    html = templates.get_template("page.html.j2").render(
        title=printable(title), verdict=verdict, facts=facts, steps=shown, version=__version__
    )
    kept[PAGE] = printable_lines(html.lstrip()).encode()
    write_files(kept, folder)
    for path in Path(folder).iterdir():
        if path.name not in kept and OWN_FILE.fullmatch(path.name):
            path.unlink()
