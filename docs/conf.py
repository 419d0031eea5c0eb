"""Sphinx configuration; `scripts/docs` builds the site.

Warnings are errors, so a broken link or anchor fails the build; `check_assets` adds that no page
loads anything from another host.
"""

from __future__ import annotations

import re
import sys
import textwrap
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

import click
from sphinx.errors import ExtensionError

from fpmatch import StageRecorder, __version__, extract
from fpmatch.cli.command import Command
from fpmatch.cli.group import fpmatch as main
from fpmatch.drawing.stages.pictures import write_stages

sys.path.insert(0, str(Path(__file__).resolve().parent))
import reference_pages
import verify_walk

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sphinx.application import Sphinx

ROOT: Final = Path(__file__).resolve().parent.parent
STAGES: Final = ROOT / "docs" / "generated" / "stages"
EXPLAINED: Final = ROOT / "docs" / "generated" / "explained"
EXPLAINED_PAIR: Final = [str(ROOT / "sample_data" / f"{name}.tif") for name in ("101_1", "101_3")]
WALK: Final = ROOT / "docs" / "generated" / "walk"
WALK_PAIR: Final = ("101_1", "101_3")
SHOWN_PRINT: Final = ROOT / "sample_data" / "101_4.tif"

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

LOADED: Final = re.compile(
    r"""<(?:script|img|iframe|source|object)\b[^>]*\b(?:src|data)=["'](?:https?:)?//[^"']*"""
    r"""|<link\b(?![^>]*rel=["'](?:canonical|author|license|next|prev|search|index)["'])"""
    r"""[^>]*\bhref=["'](?:https?:)?//[^"']*"""
    r"""|(?:url\(\s*|@import\s+)["']?(?:https?:)?//[^"')]*"""
)
_REQUIRED: Final = "**Required** "
_OWN_MARKUP: Final = (".. ", ":default:", ":options:")


def make_from_code(app: Sphinx) -> None:
    """Make pictures and pages of the code as it is; to run examples, once is enough."""
    if app.builder.name != "doctest" or not (WALK / "rooms.svg").exists():
        draw_stages()
        draw_explanations()
        draw_verification()
        reference_pages.write_command_pages()
        reference_pages.write_python_pages()


def draw_stages() -> None:
    """Draw the pictures of the stages that the page on the method shows."""
    recorder = StageRecorder()
    extract(SHOWN_PRINT, recorder=recorder)
    for old in STAGES.glob("*.png"):
        old.unlink()
    write_stages(recorder.stages, STAGES)


def draw_explanations() -> None:
    """Draw the pictures of `fpmatch explain`, by the matchers as they are now."""
    for matcher in ("unit-circle", "paper"):
        words = ["explain", *EXPLAINED_PAIR, "--matcher", matcher, "-o", str(EXPLAINED / matcher)]
        main(words, standalone_mode=False)


def draw_verification() -> None:
    """Draw the walk of one verification and the imports of the rooms, from the code."""
    WALK.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as folder:
        paths = [ROOT / "sample_data" / f"{name}.tif" for name in WALK_PAIR]
        work = partial(verify_walk.verify_files, *paths, Path(folder, "overlay.png"))
        work()  # once before, so that loading modules and data is not part of the walk
        walk = verify_walk.draw_walk(verify_walk.trace(work))
    (WALK / "verify.svg").write_text(walk, encoding="utf-8")
    rooms = verify_walk.draw_rooms(verify_walk.room_imports())
    (WALK / "rooms.svg").write_text(rooms, encoding="utf-8")


def check_assets(app: Sphinx, exception: Exception | None) -> None:
    """Fail where a page or style sheet of the site loads something from another host."""
    if exception is not None:
        return
    for path in sorted([*Path(app.outdir).rglob("*.html"), *Path(app.outdir).rglob("*.css")]):
        found = LOADED.search(path.read_text(encoding="utf-8"))
        if found is not None:
            raise ExtensionError(f"{path.relative_to(app.outdir)}: another host: {found[0]}")


def check_commands(app: Sphinx, exception: Exception | None) -> None:
    """Fail where a command is not on its page."""
    if exception is not None or app.builder.format != "html":
        return
    for name, _ in list(_commands(main, "fpmatch"))[1:]:
        page = Path(app.outdir, "generated", "commands", f"{name.split()[1]}.html")
        if f'id="{name.replace(" ", "-")}"' not in page.read_text(encoding="utf-8"):
            raise ExtensionError(f"{page.relative_to(app.outdir)}: {name} is missing")


def show_rare_options(app: Sphinx) -> None:
    """Show all that ``--help-all`` shows on the pages of the commands."""
    for _, command in _commands(main, "fpmatch"):
        for param in command.params:
            param.hidden = False
        if isinstance(command, Command):
            command.epilog = f"{command.details}\n{command.epilog}"


def _commands(command: click.Command, name: str) -> Iterator[tuple[str, click.Command]]:
    yield name, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for part in command.list_commands(context):
            below = command.get_command(context, part)
            if below is not None:
                yield from _commands(below, f"{name} {part}")


def without_folders(app: Sphinx, page: str, source: list[str]) -> None:
    """Leave of a link to a folder of the repository its text: the site has no page for one."""
    here = Path(app.srcdir, page).parent

    def shown(link: re.Match[str]) -> str:
        return link[1] if (here / link[2]).is_dir() else link[0]

    source[0] = re.sub(r"(?<!!)\[([^\]]+)\]\(([^)\s#:]+)\)", shown, source[0])


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
    """Make pictures and pages before reading; put the help of the commands into words."""
    app.connect("builder-inited", make_from_code)
    app.connect("builder-inited", show_rare_options)
    app.connect("source-read", without_folders)
    app.connect("build-finished", check_assets)
    app.connect("build-finished", check_commands)
    for part in ("description", "options", "epilog"):
        app.connect(f"sphinx-click-process-{part}", as_plain_words)
    return {"parallel_read_safe": True}
