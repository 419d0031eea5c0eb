"""The public surface, what importing it costs, and which room may import which."""

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import fpmatch
from research.rooms import MAY_IMPORT, allowed, wing_of

PACKAGE = Path(fpmatch.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))

PUBLIC = {
    *("AffineTransform", "AssessedPrint", "FpmatchError", "GreyImage", "MinutiaKind", "Minutiae"),
    *("PrintQuality", "RidgeField", "Similarity", "StageRecorder", "Template", "Verification"),
    *("__version__", "assess", "draw", "extract", "find_scale", "fmr_to_score", "load_template"),
    *("PointMatch", "match_points", "matcher_names", "read_image", "save_overlay", "save_template"),
    *("score_to_fmr", "verify", "as_template", "identify", "evaluate", "open_gallery", "Gallery"),
    *("IdentifiedFinger", "Minutia", "Overlay", "VerifiedPrints", "enrol"),
}


def test_all_is_exactly_the_public_surface():
    assert set(fpmatch.__all__) == PUBLIC
    assert set(dir(fpmatch)) >= PUBLIC


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_every_public_name_loads(name):
    assert getattr(fpmatch, name).__doc__


def imported_by(statement):
    """Return the names of all modules that a fresh interpreter holds after `statement`."""
    code = f"import sys\n{statement}\nprint(*sys.modules, file=sys.__stdout__)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    return set(done.stdout.split())


HEAVY = {"scipy", "cv2", "skimage", "PIL", "matplotlib", "numpy"}


@pytest.mark.parametrize(
    ("statement", "heavy"),
    [("import fpmatch", set()), ("import fpmatch; fpmatch.Template", {"numpy"})],
)
def test_the_package_and_its_types_cost_no_more_than_numpy(statement, heavy):
    assert imported_by(statement) & HEAVY == heavy


def imported_by_command(*words):
    return imported_by(
        "import io\nfrom fpmatch.cli.group import fpmatch as main\nsys.stdout = io.StringIO()\n"
        f"main({[*words]}, standalone_mode=False)\nsys.stdout = sys.__stdout__"
    )


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_help_imports_nothing_heavy(option):
    modules = imported_by_command(option)
    assert not modules & HEAVY
    assert not any(name.startswith("fpmatch.cli.verify") for name in modules)


def test_a_verification_imports_neither_scipy_nor_skimage():
    statement = "import fpmatch; fpmatch.extract, fpmatch.verify, fpmatch.read_image"
    assert not imported_by(statement) & {"scipy", "skimage", "matplotlib"}
    compared = "t = Template(Minutiae.empty(), 100, 100); verify(t, t)"
    modules = imported_by(f"from fpmatch import Minutiae, Template, verify; {compared}")
    assert not modules & {"sqlalchemy", "PIL", "jinja2"}


def test_the_command_verifies_with_what_it_needs_alone():
    prints = [PACKAGE.parent / "sample_data" / f"101_{n}.tif" for n in (1, 3)]
    if not all(path.exists() for path in prints):
        pytest.skip("the sample prints are not beside the package")
    modules = imported_by_command("verify", *map(str, prints))
    assert not modules & {"scipy", "skimage", "sqlalchemy", "numpy.ma", "importlib.metadata"}
    assert not modules & {"fpmatch.formats.registry", "fpmatch.drawing.scene.items"}


def test_worker_processes_import_no_commands():
    assert "click" not in imported_by("from fpmatch.cli import main")


def room_of(module):
    """Return the room of a module of the package, None for other modules and the package."""
    parts = module.split(".")
    if parts[0] != "fpmatch" or len(parts) == 1:
        return None
    folder = PACKAGE.joinpath(*parts[1:])
    folder = folder if folder.is_dir() else folder.parent
    return parts[1] if folder == PACKAGE else folder.relative_to(PACKAGE).as_posix()


@cache
def modules_imported(file):
    """Return the full names of the modules that a file imports, for types or for real."""
    package = ("fpmatch", *file.relative_to(PACKAGE).parent.parts)
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            stem = ".".join([*base, *([node.module] if node.module else [])])
            names |= {stem, *(f"{stem}.{alias.name}" for alias in node.names if stem == "fpmatch")}
    return names


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_a_room_imports_only_what_it_may(room):
    place = PACKAGE / room
    files = place.glob("*.py") if place.is_dir() else [place.with_suffix(".py")]
    imported = set().union(*map(modules_imported, files))
    assert {room_of(module) for module in imported} - {None, "__version__"} <= allowed(room)


def test_no_modules_import_each_other_in_a_circle():
    names = {
        ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts): file for file in MODULES
    }
    graph = {name: modules_imported(file) & set(names) for name, file in names.items()}
    assert len([*TopologicalSorter(graph).static_order()]) == len(names)


def test_every_folder_is_a_room_of_the_contract():
    folders = {file.parent for file in MODULES if file.name != "__init__.py"} - {PACKAGE}
    assert {folder.relative_to(PACKAGE).as_posix() for folder in folders} <= set(MAY_IMPORT)


def test_no_wing_is_imported_by_the_core_and_no_wing_imports_one_above_it():
    below = {"core": set(), "gallery": {"core"}, "server": {"core", "gallery"}}
    below["lab"] = {"core", "gallery"}
    for room in MAY_IMPORT:
        wing = wing_of(room)
        assert {wing_of(other) for other in allowed(room)} <= {wing} | below[wing], room


def test_the_import_contract_sees_what_it_forbids():
    file = PACKAGE / "cli" / "verify.py"
    assert "cli" in {room_of(module) for module in modules_imported(file)}
    assert not {"matching", "cli"} & allowed("image")
    assert not {"image", "cli"} & allowed("matching")
    assert "templates" not in allowed("pointset/paper")


def test_what_computes_writes_no_files():
    for room in ("gallery/engine", "image", "pointset", "prints"):
        for file in (PACKAGE / room).rglob("*.py"):
            writers = {"fpmatch.base.output", "fpmatch.base.folders"}
            assert not writers & modules_imported(file), file


def test_the_core_neither_prints_nor_plots():
    for file in MODULES:
        folders = file.relative_to(PACKAGE).parts
        modules = {module.split(".")[0] for module in modules_imported(file)}
        if "cli" not in folders:
            assert "click" not in modules, file
        if folders[0] != "lab":
            assert "matplotlib" not in modules, file
