"""The page of an explanation: a sentence, an equation and a picture a step, and the numbers."""

from __future__ import annotations

import re
import secrets
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.base.folders import make_folder
from fpmatch.base.html import page_templates
from fpmatch.base.output import make_missing, open_private, reason
from fpmatch.drawing.scene.items import Scene
from fpmatch.drawing.scene.svg import svg_text
from fpmatch.errors import OutputError
from fpmatch.printable import json_text, printable, printable_lines

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

    from fpmatch.lab.explain.steps import Step

PAGE, NUMBERS = "index.html", "numbers.json"
OWN_FILE: Final = re.compile(r"index\.html|numbers\.json|\d\d_[a-z_]+\.svg")


def write_page(
    folder: Path,
    title: str,
    verdict: str,
    facts: Sequence[tuple[str, str]],
    steps: Sequence[Step],
    numbers: dict[str, Any],
) -> None:
    """Write page, pictures and numbers into a new folder, or in place of an earlier explanation."""
    files: dict[str, bytes] = {}
    shown = []
    for number, step in enumerate(steps, start=1):
        name = f"{number:02d}_{step.name}.svg" if step.picture is not None else ""
        if isinstance(step.picture, Scene):
            files[name] = svg_text(step.picture).encode()
        elif step.picture is not None:
            files[name] = step.picture
        shown.append((number, step, name))
    html = (
        page_templates("fpmatch.lab.explain")
        .get_template("page.html.j2")
        .render(
            title=printable(title), verdict=verdict, facts=facts, steps=shown, version=__version__
        )
    )
    files[PAGE] = printable_lines(html.lstrip()).encode()
    files[NUMBERS] = (json_text(numbers, indent=None) + "\n").encode()
    write_folder(files, folder, replaced=OWN_FILE)


def write_folder(
    contents: Mapping[str, bytes], folder: str | os.PathLike[str], *, replaced: re.Pattern[str]
) -> None:
    """Write files, by name, as a private folder that appears whole or not at all.

    It takes the place of a folder whose files all have names that `replaced` matches; raises
    OutputError where another file is there.
    """
    target = Path(folder).resolve()
    unfinished, earlier = (target.parent / f".{secrets.token_hex(8)}.part" for _ in range(2))
    try:
        others = sorted(path.name for path in target.iterdir()) if target.exists() else []
        if other := next((name for name in others if not replaced.fullmatch(name)), None):
            raise OutputError(f"{folder}: holds another file, {other}: name a new folder")
        make_folder(target.parent)
        make_missing(unfinished)
        for name, content in contents.items():
            with open(unfinished / name, "xb", opener=open_private) as stream:
                stream.write(content)
        if target.exists():
            target.rename(earlier)
        unfinished.rename(target)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {reason(error)}") from error
    finally:
        if earlier.exists() and not target.exists():
            earlier.rename(target)
        for rest in (unfinished, earlier):
            shutil.rmtree(rest, ignore_errors=True)
