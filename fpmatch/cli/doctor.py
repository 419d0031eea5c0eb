"""`fpmatch doctor`: what is installed and what it can use, with versions, kernels and memory."""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
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
from fpmatch.matching.registry import own_matcher_names
from fpmatch.printable import json_text, text_table

# Of pyproject.toml, which an installed package does not contain; a test compares them.
CORE: Final = (
    *("numpy", "scipy", "opencv-python-headless", "scikit-image", "pillow", "click", "Cython"),
    *("lazy-loader", "threadpoolctl", "SQLAlchemy", "platformdirs", "jinja2", "filelock"),
)
EXTRAS: Final = {
    "plot": ("matplotlib",),
    "web": (
        *("fastapi", "h11", "hypercorn", "prometheus-client", "python-json-logger"),
        *("python-multipart", "starlette"),
    ),
    "postgres": ("psycopg",),
    "parquet": ("pyarrow",),
    "encryption": ("cryptography", "keyring"),
    "dask": ("distributed", "tornado"),
}
_OTHER_NAMES: Final = {
    "opencv-python-headless": ("opencv-python", "opencv-contrib-python-headless", "opencv")
}
_MEMORY_LIMITS: Final = (  # of a container, by the second and the first version of Linux's cgroups
    Path("/sys/fs/cgroup/memory.max"),
    Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"),
)


@dataclass(frozen=True, slots=True)
class PluginState:
    """A matcher or format of another package; `problem` is "" if it can be used."""

    name: str
    source: str  # package, version and module
    problem: str


@dataclass(frozen=True, slots=True)
class Installation:
    """The parts that are installed; versions are None for packages that are missing."""

    version: str
    folder: str
    python: str
    free_threaded: bool
    platform: str
    packages: dict[str, str | None]
    extras: dict[str, dict[str, str | None]]
    kernels: dict[str, bool]
    outdated_kernels: tuple[str, ...]
    cores: int
    memory: int | None
    memory_limit: int | None
    matchers: tuple[PluginState, ...]
    formats: tuple[PluginState, ...]
    commands: tuple[PluginState, ...]

    @property
    def engines(self) -> dict[str, bool]:
        """Whether each engine can be used."""
        return {"serial": True, "processes": True, "dask": None not in self.extras["dask"].values()}

    @property
    def problems(self) -> list[str]:
        """What is missing or fails; kernels that are not compiled work."""
        missing = [f"{name} is not installed" for name, one in self.packages.items() if one is None]
        failed = [
            f"{kind} {one.name}: {one.problem}"
            for kind, plugins in self._plugins.items()
            for one in plugins
            if one.problem
        ]
        outdated = [f"kernels out of date: `{build_command()}` compiles them"]
        return missing + failed + outdated * bool(self.outdated_kernels)

    @property
    def _plugins(self) -> dict[str, tuple[PluginState, ...]]:
        """What other packages add, by its kind."""
        return {"matcher": self.matchers, "format": self.formats, "command": self.commands}

    def as_dict(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        return {**asdict(self), "engines": self.engines, "problems": self.problems}

    def as_text(self) -> str:
        """Return everything as lines for people."""
        memory = _gigabytes(self.memory)
        if self.memory_limit is not None:
            memory += f", of which this container may use {_gigabytes(self.memory_limit)}"
        slow = [name for name, compiled in self.kernels.items() if not compiled]
        compiled = f"{len(self.kernels) - len(slow)} of {len(self.kernels)} compiled"
        if slow:
            names = f", not {', '.join(slow)}" if len(slow) < len(self.kernels) else ""
            compiled += f"{names}: slow; with a C compiler, `{build_command()}` compiles them"
        if self.outdated_kernels:
            compiled += f"; out of date: {', '.join(self.outdated_kernels)}"
        engines = [name for name, usable in self.engines.items() if usable]
        rows = [
            ("fpmatch", f"{self.version}, in {self.folder}"),
            ("Python", f"{self.python}{', free-threaded' * self.free_threaded}"),
            ("system", self.platform),
            ("cores", str(self.cores)),
            ("memory", memory),
            ("kernels", compiled),
            ("engines", ", ".join(engines)),
            ("packages", _versions(self.packages)),
        ]
        rows += [(f"extra {name}", _versions(versions)) for name, versions in self.extras.items()]
        for kind, plugins in self._plugins.items():
            shown = [f"{one.name} ({one.source})" for one in plugins if not one.problem]
            rows.append((f"{kind}s added", ", ".join(shown) or "none"))
        return text_table(rows, left=2)


def inspect_installation() -> Installation:
    """Return what is installed; plug-ins are imported, kernels are not."""
    memory, limit = _memory(), _memory_limit()
    return Installation(
        version=__version__,
        folder=str(Path(__file__).parents[1]),
        python=f"{platform.python_implementation()} {platform.python_version()}, {sys.executable}",
        free_threaded=not getattr(sys, "_is_gil_enabled", lambda: True)(),
        platform=platform.platform(),
        packages={name: _version(name) for name in CORE},
        extras={extra: {name: _version(name) for name in names} for extra, names in EXTRAS.items()},
        kernels=compiled_kernels(),
        outdated_kernels=tuple(outdated_kernels()),
        cores=available_cores(),
        memory=memory,
        memory_limit=limit if limit is not None and limit < (memory or limit + 1) else None,
        matchers=_plugins(MATCHERS, own_matcher_names()),
        formats=_plugins(FORMATS, {codec.name for codec in CODECS}),
        commands=_plugins(COMMANDS, set()),
    )


def _plugins(group: str, own: set[str]) -> tuple[PluginState, ...]:
    """Return the state of each plug-in of a group; `own` are the names that fpmatch uses."""
    plugins = load_plugins(group)
    return tuple(
        PluginState(
            name,
            plugin_source(group, name),
            "the name is one of fpmatch's own" if name in own else plugins.failures.get(name, ""),
        )
        for name in sorted({*plugins.loaded, *plugins.failures})
    )


def _version(name: str) -> str | None:
    for one in (name, *_OTHER_NAMES.get(name, ())):
        try:
            return version(one)
        except PackageNotFoundError:
            pass
    return None


def _versions(versions: dict[str, str | None]) -> str:
    return ", ".join(f"{name} {one or 'missing'}" for name, one in versions.items())


def _memory() -> int | None:
    """Return the bytes of memory of this computer; None where Python cannot tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return None


def _memory_limit() -> int | None:
    """Return the bytes that the container may use; None where there is no limit."""
    for file in _MEMORY_LIMITS:
        try:
            text = file.read_text(encoding="ascii").strip()
        except OSError:
            continue
        return int(text) if text.isdecimal() else None
    return None


def _gigabytes(count: int | None) -> str:
    return "unknown" if count is None else f"{count / 2**30:.1f} GiB"


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
    """Show what is installed: versions, compiled kernels, extras, plug-ins, cores and memory.

    Send it along when you report a problem: it contains no prints and no names of files of yours
    other than the folder of the installation.
    """
    if list_matchers:
        from fpmatch.cli.matchers import matchers_document, matchers_text

        show(json_text(matchers_document()) if as_json else matchers_text())
        return 0
    installation = inspect_installation()
    show(json_text(installation.as_dict()) if as_json else installation.as_text())
    say_errors(installation.problems)
    return 1 if installation.problems else 0
