"""`fpmatch doctor`: what is installed and what is missing, with versions and kernels."""

from __future__ import annotations

import platform
import re
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any, Final

import click

from fpmatch._version import __version__
from fpmatch.base.kernels import build_command, compiled_kernels, outdated_kernels
from fpmatch.base.plugins import COMMANDS, FORMATS, MATCHERS, load_plugins, plugin_source
from fpmatch.base.threads import available_cores
from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_errors, show
from fpmatch.cli.options import json_option
from fpmatch.formats.registry import CODECS
from fpmatch.matching.registry import OWN_MATCHERS
from fpmatch.printable import json_text, text_table

_FOR_DEVELOPERS: Final = {"bench", "browser", "dev", "docs", "test", "train"}  # extras
_REQUIRED: Final = re.compile(r"""([\w.-]+).*?(?:;\s*extra\s*==\s*["']([\w-]+)["'])?\s*""")
_OTHER_NAMES: Final = {
    "opencv-python-headless": ("opencv-python", "opencv-contrib-python-headless", "opencv")
}


def inspect_installation() -> dict[str, Any]:
    """Return what is installed, as JSON values; plug-ins are imported, kernels are not.

    Versions are None for packages that are missing. ``problems`` has what is missing or fails;
    kernels that are not compiled work.
    """
    packages = _packages()
    plugins = {
        "matchers": _plugins(MATCHERS, set(OWN_MATCHERS)),
        "formats": _plugins(FORMATS, {codec.name for codec in CODECS}),
        "commands": _plugins(COMMANDS, set()),
    }
    outdated = outdated_kernels()
    needed = packages.pop("", {})
    missing = [f"{name} is not installed" for name, one in needed.items() if one is None]
    failed = [
        f"{kind[:-1]} {one['name']}: {one['problem']}"
        for kind, of in plugins.items()
        for one in of
        if one["problem"]
    ]
    old = [f"kernels out of date: `{build_command()}` compiles them"] * bool(outdated)
    return {
        "version": __version__,
        "folder": str(Path(__file__).parents[1]),
        "python": f"{platform.python_implementation()} {platform.python_version()}, "
        f"{sys.executable}",
        "platform": platform.platform(),
        "cores": available_cores(),
        "packages": needed,
        "extras": packages,
        "kernels": compiled_kernels(),
        "outdated_kernels": outdated,
        **plugins,
        "problems": missing + failed + old,
    }


def installation_text(installed: dict[str, Any]) -> str:
    """Return what `inspect_installation` returns as lines for people."""
    kernels, outdated = installed["kernels"], installed["outdated_kernels"]
    slow = [name for name, compiled in kernels.items() if not compiled]
    compiled = f"{len(kernels) - len(slow)} of {len(kernels)} compiled"
    if slow:
        names = f", not {', '.join(slow)}" if len(slow) < len(kernels) else ""
        compiled += f"{names}: slow; with a C compiler, `{build_command()}` compiles them"
    if outdated:
        compiled += f"; out of date: {', '.join(outdated)}"
    rows = [
        ("fpmatch", f"{installed['version']}, in {installed['folder']}"),
        ("Python", installed["python"]),
        ("system", installed["platform"]),
        ("cores", str(installed["cores"])),
        ("kernels", compiled),
        ("packages", _versions(installed["packages"])),
    ]
    rows += [(f"extra {name}", _versions(of)) for name, of in installed["extras"].items()]
    for kind in ("matchers", "formats", "commands"):
        usable = [one for one in installed[kind] if not one["problem"]]
        shown = [f"{one['name']} ({one['source']})" for one in usable]
        rows.append((f"{kind} added", ", ".join(shown) or "none"))
    return text_table(rows, left=2)


def _packages() -> dict[str, dict[str, str | None]]:
    """Return the versions of the packages that fpmatch requires, by extra, "" for none."""
    try:
        required = requires("fpmatch") or []
    except PackageNotFoundError:  # the source tree alone
        required = []
    packages: dict[str, dict[str, str | None]] = {}
    for match in filter(None, map(_REQUIRED.fullmatch, required)):
        name, extra = match[1], match[2] or ""
        if extra not in _FOR_DEVELOPERS:
            packages.setdefault(extra, {})[name] = _version(name)
    return packages


def _plugins(group: str, own: set[str]) -> list[dict[str, str]]:
    """Return name, source and problem of each plug-in of a group; `own` are fpmatch's names."""
    loaded, failures = load_plugins(group)
    taken = dict.fromkeys(own, "the name is one of fpmatch's own")
    problems = dict.fromkeys(loaded, "") | failures
    return [
        {"name": name, "source": plugin_source(group, name), "problem": taken.get(name, why)}
        for name, why in sorted(problems.items())
    ]


def _version(name: str) -> str | None:
    for one in (name, *_OTHER_NAMES.get(name, ())):
        try:
            return version(one)
        except PackageNotFoundError:
            pass
    return None


def _versions(versions: dict[str, str | None]) -> str:
    return ", ".join(f"{name} {one or 'missing'}" for name, one in versions.items())


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  fpmatch doctor
  fpmatch doctor --matchers
  fpmatch doctor --json

Exit status: 0 when all is well, 1 when a package that fpmatch needs is missing, a plug-in cannot be
used or kernels are out of date (a line on stderr says so). Kernels that are not compiled work, but
slowly; one that is out of date was compiled before its file changed.
""",
)
@click.option(
    "--matchers",
    "list_matchers",
    is_flag=True,
    help="List the parameters of the matchers instead, with default, range, unit and meaning.",
)
@json_option
def doctor(list_matchers: bool, as_json: bool) -> int:
    """Show what is installed: versions, compiled kernels, extras, plug-ins, cores.

    Send it along when you report a problem: it contains no prints and no names of files of yours
    other than the folder of the installation.
    """
    if list_matchers:
        from fpmatch.cli.matchers import matchers_document, matchers_text

        show(json_text(matchers_document()) if as_json else matchers_text())
        return 0
    installed = inspect_installation()
    show(json_text(installed) if as_json else installation_text(installed))
    say_errors(installed["problems"])
    return 1 if installed["problems"] else 0
