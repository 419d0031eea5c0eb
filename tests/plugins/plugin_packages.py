"""Packages with plug-ins: those that the documentation shows, and broken ones."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GUIDES = ROOT / "docs" / "how-to"
CAPTIONED = re.compile(
    r"^```\{code-block\} \w+\n:caption: (\S+)\n\n(.*?)^```$", re.MULTILINE | re.S
)


def shown_package(page, folder):
    """Write the files that a page shows into a folder, and return it."""
    folder.mkdir()
    for name, content in CAPTIONED.findall((GUIDES / page).read_text("utf-8")):
        (folder / name).write_text(content, "utf-8")
    return folder


def shown_commands(page):
    """Return the commands `fpmatch` of a page's first part, each as its words."""
    text = (GUIDES / page).read_text("utf-8").partition("## In fpmatch itself")[0]
    lines = re.findall(r"^fpmatch (.*?)(?: +#.*)?$", text, re.MULTILINE)
    return [line.split() for line in lines]


def install(package, site):
    """Put a package into a folder for packages, as an installer does."""
    project = tomllib.loads((package / "pyproject.toml").read_text("utf-8"))["project"]
    for file in package.glob("*.py"):
        (site / file.name).write_bytes(file.read_bytes())
    install_points(site, project["name"], project["entry-points"])


def install_points(site, name, groups):
    """Describe a package with entry points in a folder for packages."""
    info = site / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = []
    for group, points in groups.items():
        lines += [f"[{group}]", *(f"{key} = {place}" for key, place in points.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")


def fpmatch(*words, cwd, path=None):
    """Run ``fpmatch`` in a process of its own, with a folder of packages on its path."""
    kept = os.environ.get("PYTHONPATH", "")
    paths = [*([] if path is None else [str(path)]), *([kept] if kept else [])]
    return subprocess.run(
        [sys.executable, "-P", "-m", "fpmatch", *map(str, words)],
        cwd=cwd,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths), "PYTHONUTF8": "1"},
        capture_output=True,
        encoding="utf-8",
        timeout=300,
        check=False,
    )
