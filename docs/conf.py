"""Sphinx configuration; `scripts/docs` builds the site.

Warnings are errors, so a broken link or anchor inside the site fails the build.
"""

from __future__ import annotations

import re
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch import StageRecorder, __version__, extract
from fpmatch.cli.command import Command
from fpmatch.cli.group import fpmatch as main
from fpmatch.drawing.stages import write_stages

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sphinx.application import Sphinx

ROOT: Final = Path(__file__).resolve().parent.parent
SAMPLES: Final = ROOT / "sample_data"
STAGES: Final = ROOT / "docs" / "generated" / "stages"
EXPLAINED: Final = ROOT / "docs" / "generated" / "explained" / "unit-circle"

project = "fpmatch"
author = "the authors of fpmatch"
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.doctest",
    "numpydoc",
    "sphinx_click",
]
myst_heading_anchors = 3
suppress_warnings = ["myst.header"]  # the headings of tables that scripts make skip a level
templates_path = ["templates"]
default_role = "py:obj"
numpydoc_show_class_members = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"

html_theme = "furo"
html_title = f"fpmatch {__version__}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
smartquotes = False  # would turn the dashes of --options into one

# The examples of a page run in a folder of their own, which holds what they read of the repository.
# They import what they use: every name that is set here begins with an underscore.
doctest_global_setup = f"""
import os as _os, shutil as _shutil, tempfile as _tempfile
_here, _there = _os.getcwd(), _tempfile.mkdtemp()
for _folder in ("sample_data", "docs/how-to/one_file"):
    _shutil.copytree(_os.path.join({str(ROOT)!r}, _folder), _os.path.join(_there, _folder))
_os.chdir(_there)
"""
doctest_global_cleanup = """
_os.chdir(_here)
_shutil.rmtree(_there)
"""

_REQUIRED: Final = "**Required** "
_OWN_MARKUP: Final = (".. ", ":default:", ":options:")


def draw_pictures(app: Sphinx) -> None:
    """Draw the stages of an extraction and the steps of a comparison, by the code as it is."""
    recorder = StageRecorder()
    extract(SAMPLES / "101_4.tif", recorder=recorder)
    for old in STAGES.glob("*.png"):
        old.unlink()
    write_stages(recorder.stages, STAGES)
    pair = [str(SAMPLES / name) for name in ("101_1.tif", "101_3.tif")]
    main(["explain", *pair, "-o", str(EXPLAINED)], standalone_mode=False)


def show_rare_options(app: Sphinx) -> None:
    """Show in the reference all that ``--help-all`` shows."""
    for command in _commands(main):
        for param in command.params:
            param.hidden = False
        if isinstance(command, Command):
            command.epilog = f"{command.details}\n{command.epilog}"


def _commands(command: click.Command) -> Iterator[click.Command]:
    yield command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            if below is not None:
                yield from _commands(below)


def as_plain_words(app: Sphinx, ctx: click.Context, lines: list[str]) -> None:
    """Escape a command's help so that it is not read as markup."""
    lines[:] = [line for paragraph in _paragraphs(lines) for line in _in_markup(paragraph)]


def _paragraphs(lines: list[str]) -> list[list[str]]:
    """Split lines at blank ones."""
    paragraphs: list[list[str]] = [[]]
    for line in lines:
        if line.strip():
            paragraphs[-1].append(line)
        else:
            paragraphs.append([])
    return [paragraph for paragraph in paragraphs if paragraph]


def _in_markup(paragraph: list[str]) -> list[str]:
    """Return a paragraph as words, or as a literal block where its lines are to stay as they are.

    The lines of a table or of examples begin with a bar and, below a heading that ends in a colon,
    are indented. So are some that are words all the same.
    """
    rows = [line.removeprefix("| ") for line in paragraph]
    if rows == paragraph:
        flowing = not rows[0].startswith((" ", *_OWN_MARKUP))
        return [*map(_escaped, [" ".join(rows)] if flowing else rows), ""]
    heading = [f".. rubric:: {rows.pop(0)[:-1]}", ""] if rows[0].endswith(":") else []
    rows = textwrap.dedent("\n".join(rows)).splitlines()
    if any(re.search(r"^ |\S  +\S|\bfpmatch [a-zC]", row) for row in rows):
        language = "shell" if "Examples" in "".join(heading) else "text"
        return [*heading, f".. code-block:: {language}", "", *(f"    {row}" for row in rows), ""]
    return [*heading, _escaped(" ".join(rows)), ""]


def _escaped(line: str) -> str:
    """Return a line of words with what would be markup escaped, `code` as code."""
    words = line.lstrip()
    if words.startswith(_OWN_MARKUP):
        return line
    indent, start = line[: len(line) - len(words)], ""
    if words.startswith(_REQUIRED):
        start, words = _REQUIRED, words.removeprefix(_REQUIRED)
    parts = re.split(r"`([^`]+)`", words)
    parts[::2] = [re.sub(r"([\\*_|`]|(?<=\bfile):)", r"\\\1", part) for part in parts[::2]]
    parts[1::2] = [f"``{part}``" for part in parts[1::2]]
    return f"{indent}{start}{''.join(parts)}"


def setup(app: Sphinx) -> dict[str, Any]:
    """Draw pictures before reading; put the help of the commands into words."""
    app.connect("builder-inited", draw_pictures)
    app.connect("builder-inited", show_rare_options)
    for part in ("description", "options", "epilog"):
        app.connect(f"sphinx-click-process-{part}", as_plain_words)
    return {"parallel_read_safe": True}
