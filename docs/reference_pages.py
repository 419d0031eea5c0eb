"""Write the pages of the reference: a page a command, a section of public names or a module."""

from __future__ import annotations

import re
from enum import Enum
from pathlib import Path
from pkgutil import resolve_name
from types import ModuleType
from typing import TYPE_CHECKING, Final

import click

import fpmatch
from fpmatch.cli.group import CORE
from fpmatch.cli.group import fpmatch as main
from fpmatch.cli.wings import registered

if TYPE_CHECKING:
    from collections.abc import Mapping

DOCS: Final = Path(__file__).resolve().parent
GENERATED: Final = DOCS / "generated"


def write_command_pages() -> None:
    """Write a page for each command, and their list by wing."""
    pages, rows = {}, []
    sections = {"": CORE} | {wing.title: wing.commands for wing in registered().values()}
    for title, summaries in sections.items():
        rows += [f".. rubric:: {title}\n"] if title else []
        for name, summary in summaries.items():
            pages[name] = _command_page(name)
            rows.append(f":doc:`fpmatch {name} </generated/commands/{name}>`\n    {summary}\n")
    _write("commands", pages, "\n".join(rows))


def write_python_pages() -> None:
    """Write a page for the public names of each section of the index, and for each module."""
    pages: dict[str, str] = {}
    section = ""
    for line in (DOCS / "reference" / "api.md").read_text(encoding="utf-8").splitlines():
        section = line.removeprefix("## ") if line.startswith("## ") else section
        if name := re.fullmatch(r"   (fpmatch\.[\w.]+)", line):
            module = name[1].rpartition(".")[0]
            title, shown = (section,) * 2 if module == "fpmatch" else (module, f"``{module}``")
            head = f"{shown}\n{'=' * len(shown)}\n"
            pages[title] = f"{pages.get(title, head)}\n{_described(name[1])}"
    _write("python", pages)


def _command_page(name: str) -> str:
    command = main.get_command(click.Context(main), name)
    assert command is not None
    assert command.callback is not None
    module, attribute = command.callback.__module__, name.replace("-", "_")
    return f".. click:: {module}:{attribute}\n   :prog: fpmatch {name}\n   :nested: full\n"


def _described(name: str) -> str:
    """Return the directive that describes an object of the package; of a module, its classes."""
    thing = resolve_name(name)
    if isinstance(thing, ModuleType):
        classes = [key for key, of in vars(thing).items() if isinstance(of, type)]
        own = [key for key in classes if vars(thing)[key].__module__ == name]
        members = ", ".join(key for key in own if not hasattr(fpmatch, key))
        return f".. automodule:: {name}\n   :members: {members}\n   :show-inheritance:\n"
    if not isinstance(thing, type):
        return f".. autofunction:: {name}\n"
    if issubclass(thing, Exception):
        return f".. autoexception:: {name}\n   :show-inheritance:\n"
    undocumented = "   :undoc-members:\n" if issubclass(thing, Enum) else ""
    return f".. autoclass:: {name}\n   :members:\n{undocumented}"


def _write(folder: str, pages: Mapping[str, str], index: str = "") -> None:
    """Write pages by title, and what their index includes: a text, and where the pages lie."""
    target = GENERATED / folder
    target.mkdir(parents=True, exist_ok=True)
    for old in target.iterdir():
        old.unlink()
    tree = ""
    for title, text in pages.items():
        name, short = title.replace(" ", "_").lower(), ".".join(title.split(".")[-2:])
        (target / f"{name}.rst").write_text(text, encoding="utf-8")
        tree += f"   {short} </generated/{folder}/{name}>\n"
    text = f"{index}\n.. toctree::\n   :hidden:\n\n{tree}"
    (target / "index.txt").write_text(text, encoding="utf-8")
