"""Kernels with AddressSanitizer and UndefinedBehaviorSanitizer, and a Python that runs them.

They are built once for each state of their sources, in a folder of their own; the program then
runs again, in a Python that loads the sanitizers first, and takes the package from that folder.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Sequence

ROOT = Path(__file__).resolve().parents[2]
CACHE = ROOT / "out" / "sanitized"
LIBRARIES = ("libasan.so", "libubsan.so")
_RUNNING = "FPMATCH_SANITIZED_LIBRARY"  # where the running process has its kernels from
_SHOWN_LINES = 20  # of a compiler's output
_REPORT = re.compile(
    r"ERROR: (?P<address>AddressSanitizer: [\w-]+)|runtime error: (?P<undefined>.*)"
)
_PLACES = [
    re.compile(pattern) for pattern in (r"(\w+_kernel)\.c:(\d+)", r"(\w+_kernel)\.cpython()")
]
_KERNELS = ("_*_kernel.py", "*.pxd")
_BUILD_FILES = ("setup.py", "pyproject.toml", "README.md", "LICENSE")


def run_sanitized(arguments: Sequence[str]) -> None:
    """Return where this process has sanitized kernels; else build them, and run it again so."""
    if is_sanitized():
        return
    libraries = _libraries()
    library = _build()
    reports = CACHE / "reports"
    shutil.rmtree(reports, ignore_errors=True)
    reports.mkdir(parents=True)
    environment = os.environ | {
        _RUNNING: str(library),
        "LD_PRELOAD": " ".join(map(str, libraries)),
        "PYTHONMALLOC": "malloc",
        "PYTHONPATH": os.pathsep.join([str(library), str(ROOT)]),
        "ASAN_OPTIONS": "detect_leaks=0:allocator_may_return_null=1:detect_odr_violation=0:"
        f"quarantine_size_mb=32:log_path={reports}/report",
        "UBSAN_OPTIONS": f"print_stacktrace=1:log_path={reports}/report",
    }
    command = [sys.executable, "-P", "-m", "research", *arguments]
    sys.stdout.flush()
    os.execve(sys.executable, command, environment)


def is_sanitized() -> bool:
    """Return whether the kernels of this process are sanitized ones."""
    return _RUNNING in os.environ


def report_of(pid: int | None) -> str:
    """Return what a sanitizer reported about a process that has ended; "" where nothing."""
    path = CACHE / "reports" / f"report.{pid}"
    if not is_sanitized() or not path.exists():
        return ""
    return path.read_text("utf-8", "replace")


def reason_of(report: str) -> str:
    """Return kind and place of a report in one line."""
    found = _REPORT.search(report)
    what = "a sanitizer's report"
    if found:
        what = found["address"] or f"UndefinedBehaviorSanitizer {found['undefined']}"
    place = next((match for one in _PLACES if (match := one.search(report))), None)
    where = ":".join(filter(None, place.groups())) if place else "no kernel"
    return f"{what.replace(': ', ' ')} in {where}"


def _libraries() -> list[Path]:
    """Return the libraries of the sanitizers, which must be loaded before Python."""
    compiler = (sysconfig.get_config_var("CC") or "gcc").split()[0]
    found = []
    for name in LIBRARIES:
        try:
            done = subprocess.run(
                [compiler, f"-print-file-name={name}"], capture_output=True, text=True, check=True
            )
        except (OSError, subprocess.CalledProcessError) as error:
            raise FpmatchError(f"--sanitize needs gcc on Linux: {compiler} does not run") from error
        path = Path(done.stdout.strip())
        if not path.is_absolute():
            raise FpmatchError(f"--sanitize needs gcc with its sanitizers: it has no {name}")
        found.append(path.resolve())
    return found


def _build() -> Path:
    """Return the folder of the package with sanitized kernels, built where it is not there."""
    folder = CACHE / _hash()
    library = folder / "lib"
    if not (folder / "whole").exists():
        _compile(folder, library)
    others = shutil.ignore_patterns("*.so", "*.pyd", "__pycache__")
    shutil.copytree(ROOT / "fpmatch", library / "fpmatch", ignore=others, dirs_exist_ok=True)
    return library


def _compile(folder: Path, library: Path) -> None:
    """Compile the kernels into a folder."""
    shutil.rmtree(folder, ignore_errors=True)
    click.echo(f"building sanitized kernels in {folder} (some minutes)", err=True)
    environment = os.environ | {"FPMATCH_SANITIZE": "1", "FPMATCH_REQUIRE_KERNELS": "1"}
    source = folder / "source"  # a copy: nothing that was compiled before is taken
    others = shutil.ignore_patterns("*.so", "*.pyd", "*.c", "__pycache__")
    shutil.copytree(ROOT / "fpmatch", source / "fpmatch", ignore=others)
    for name in _BUILD_FILES:
        shutil.copy(ROOT / name, source)
    words = ["-m", "pip", "install", "-q", "--no-deps", "--target", str(library), str(source)]
    done = subprocess.run(
        [sys.executable, *words], env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        last = "\n".join(done.stderr.splitlines()[-_SHOWN_LINES:])
        raise FpmatchError(f"the sanitized kernels cannot be built: {last}")
    shutil.rmtree(source, ignore_errors=True)
    (folder / "whole").touch()


def _hash() -> str:
    """Return a digest of all that the kernels are compiled from."""
    digest = hashlib.sha256(sys.version.encode())
    paths = [path for pattern in _KERNELS for path in (ROOT / "fpmatch").rglob(pattern)]
    for path in [ROOT / "setup.py", *sorted(paths)]:
        digest.update(f"{path.relative_to(ROOT)}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:16]
