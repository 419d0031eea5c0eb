"""The public surface, and what importing it costs."""

import subprocess
import sys
from pathlib import Path

import pytest

import fpmatch

PACKAGE = Path(fpmatch.__file__).parent


@pytest.mark.parametrize("name", fpmatch.__all__)
def test_every_public_name_loads_and_is_documented(name):
    assert name in dir(fpmatch)
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
