"""The public surface, what importing it costs, and which room may import which."""

from __future__ import annotations

import ast
import importlib
import importlib.machinery
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

import fpmatch

PACKAGE: Final = Path(fpmatch.__file__).parent
MODULES: Final = sorted(PACKAGE.rglob("*.py"))
KERNELS: Final = sorted(PACKAGE.rglob("_*_kernel.py"))

PUBLIC: Final = {
    "AssessedPrint",
    "FpmatchError",
    "GreyImage",
    "MinutiaKind",
    "Minutiae",
    "PointMatch",
    "PrintQuality",
    "RidgeField",
    "Similarity",
    "StageRecorder",
    "Template",
    "Verification",
    "__version__",
    "assess",
    "draw",
    "extract",
    "find_scale",
    "fmr_to_score",
    "load_template",
    "match_points",
    "matcher_names",
    "read_image",
    "save_overlay",
    "save_template",
    "score_to_fmr",
    "verify",
}

# What each room may import of the others, besides errors, minutiae, output and what those import.
MAY_IMPORT: Final[dict[str, set[str]]] = {
    "_version": set(),
    "errors": set(),
    "minutiae": set(),
    "scale": {"matching"},
    "output": set(),
    "text_table": set(),
    "pointset": set(),
    "binary_records": set(),
    "image": {"binary_records"},
    "matching": {"pointset"},
    "formats": {"binary_records"},
    "drawing": {"matching"},
    "engine": set(),
    "synthesis": {"pointset", "engine"},
    "reading": {"formats", "image"},
    "pair": {"matching", "reading", "report", "scale"},
    "gallery": {"engine", "formats", "image", "matching", "reading"},
    "evaluation": {"image", "matching", "drawing", "engine", "gallery", "synthesis"},
    "report": {"matching", "drawing", "image", "scale", "pointset"},
    "web": {
        "image",
        "matching",
        "formats",
        "drawing",
        "engine",
        "gallery",
        "pair",
        "reading",
    },
    "cli": {
        "image",
        "matching",
        "formats",
        "drawing",
        "evaluation",
        "synthesis",
        "engine",
        "gallery",
        "pair",
        "reading",
        "report",
        "web",
    },
    "__main__": {"cli"},
}
# Modules that must hear of no minutiae: the first is their currency, the second bare points.
NO_MINUTIAE: Final = {"_version", "errors", "output", "binary_records", "pointset"}
WRITES_FILES: Final = {"matching", "formats", "drawing", "evaluation", "synthesis", "cli"}


def test_all_is_exactly_the_public_surface() -> None:
    assert set(fpmatch.__all__) == PUBLIC
    assert set(dir(fpmatch)) >= PUBLIC


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_every_public_name_loads(name: str) -> None:
    assert getattr(fpmatch, name).__doc__


def imported_by(statement: str) -> set[str]:
    """Return the names of all modules that a fresh interpreter holds after `statement`."""
    code = f"import sys\n{statement}\nprint(*sys.modules, file=sys.__stdout__)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    return set(done.stdout.split())


HEAVY: Final = {"scipy", "cv2", "skimage", "PIL", "matplotlib", "numpy"}


def test_importing_the_package_imports_nothing_heavy() -> None:
    assert not imported_by("import fpmatch") & HEAVY


def test_types_cost_no_more_than_numpy() -> None:
    assert imported_by("import fpmatch; fpmatch.Template") & HEAVY == {"numpy"}


def test_help_imports_nothing_heavy() -> None:
    statement = (
        "import io\nfrom fpmatch.cli.group import fpmatch as main\nsys.stdout = io.StringIO()\n"
        "main(['--help'], standalone_mode=False)\nsys.stdout = sys.__stdout__"
    )
    modules = imported_by(statement)
    assert not modules & HEAVY
    assert not any(name.startswith("fpmatch.cli.verify") for name in modules)


def test_a_verification_imports_neither_scipy_nor_skimage() -> None:
    statement = "import fpmatch; fpmatch.extract, fpmatch.verify, fpmatch.read_image"
    assert not imported_by(statement) & {"scipy", "skimage", "matplotlib"}


def test_the_command_verifies_with_what_it_needs_alone() -> None:
    prints = [str(PACKAGE.parent / "sample_data" / f"101_{n}.tif") for n in (1, 3)]
    if not all(Path(path).exists() for path in prints):
        pytest.skip("the sample prints are not beside the package")
    statement = (
        "import io\nfrom fpmatch.cli.group import fpmatch as main\nsys.stdout = io.StringIO()\n"
        f"main(['verify', *{prints}], standalone_mode=False)\nsys.stdout = sys.__stdout__"
    )
    modules = imported_by(statement)
    assert not modules & {"scipy", "skimage", "sqlalchemy", "numpy.ma", "importlib.metadata"}
    assert not modules & {"fpmatch.formats.registry", "fpmatch.drawing.scene.items"}


def test_worker_processes_import_no_commands() -> None:
    assert "click" not in imported_by("from fpmatch.cli import main")


def allowed(room: str) -> set[str]:
    """Return every room that `room` may import, directly or by way of another."""
    rooms = {room, "_version", "errors", "text_table"}
    if room not in NO_MINUTIAE:
        rooms.add("minutiae")
    if room in WRITES_FILES:
        rooms.add("output")
    for other in MAY_IMPORT[room]:
        rooms |= allowed(other)
    return rooms


def room_of(module: str) -> str | None:
    """Return the room of a module of the package, None for other modules and the package."""
    parts = module.split(".")
    return parts[1] if parts[0] == "fpmatch" and len(parts) > 1 else None


def modules_imported(file: Path) -> Iterator[str]:
    """Yield the full names of the modules that a file imports, for types or for real."""
    package = ("fpmatch", *file.relative_to(PACKAGE).parent.parts)
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            stem = ".".join([*base, *([node.module] if node.module else [])])
            yield stem
            yield from (f"{stem}.{alias.name}" for alias in node.names if stem == "fpmatch")


@pytest.mark.parametrize("file", MODULES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_a_room_imports_only_what_it_may(file: Path) -> None:
    room = file.relative_to(PACKAGE).parts[0].removesuffix(".py")
    if room == "__init__":
        room = "_version"  # the package itself names its parts in its stub, and imports none
    rooms = {room_of(module) for module in modules_imported(file)} - {None, "__version__"}
    assert rooms <= allowed(room)


def test_the_import_contract_sees_what_it_forbids(tmp_path: Path) -> None:
    file = PACKAGE / "cli" / "verify.py"
    assert "cli" in {room_of(module) for module in modules_imported(file)}
    assert "cli" not in set().union(
        *(allowed(room) for room in set(MAY_IMPORT) - {"cli", "__main__"})
    )
    assert "image" not in allowed("matching")
    assert "matching" not in allowed("image")
    assert "minutiae" not in allowed("pointset")


def test_the_core_neither_prints_nor_plots() -> None:
    for file in MODULES:
        room = file.relative_to(PACKAGE).parts[0]
        modules = {module.split(".")[0] for module in modules_imported(file)}
        if room != "cli":
            assert "click" not in modules, file
        if room not in {"drawing", "evaluation"}:
            assert "matplotlib" not in modules, file


@pytest.mark.skipif(
    "FPMATCH_EXPECT_KERNELS" not in os.environ, reason="nobody said how the kernels are built"
)
def test_kernels_are_built_as_expected() -> None:
    compiled = os.environ["FPMATCH_EXPECT_KERNELS"] == "compiled"
    suffixes = tuple(importlib.machinery.EXTENSION_SUFFIXES) if compiled else (".py",)
    assert KERNELS
    for kernel in KERNELS:
        name = ".".join(["fpmatch", *kernel.relative_to(PACKAGE).with_suffix("").parts])
        assert str(importlib.import_module(name).__file__).endswith(suffixes), name
