"""The strategies of `tests/pointset`, and the kernels' plain form, for the tests beside this."""

import importlib
import importlib.util
import sys
from pathlib import Path

import pytest

sys.path += [str(Path(__file__).parents[2] / "pointset"), str(Path(__file__).parent)]

ROOMS = ("fpmatch.pointset", "fpmatch.lab.points")


class KernelSources:
    """Finds the sources of kernels, where Python would find the compiled modules first."""

    @staticmethod
    def find_spec(name, path, _=None):
        if not (name.startswith(ROOMS) and name.endswith("_kernel")):
            return None
        source = Path(path[0], name.rpartition(".")[2] + ".py")
        return importlib.util.spec_from_file_location(name, source)


@pytest.fixture(scope="session")
def plain():
    """Return the function that imports a module, all kernels for points as ordinary Python."""
    copies = {}

    def take_out():
        names = [name for name in sys.modules if name.startswith(ROOMS)]
        return {name: sys.modules.pop(name) for name in names}

    def load(name):
        compiled = take_out()
        sys.modules.update(copies)
        sys.meta_path.insert(0, KernelSources)
        try:
            return importlib.import_module(f"fpmatch.{name}")
        finally:
            sys.meta_path.remove(KernelSources)
            copies.update(take_out())
            sys.modules.update(compiled)
            for room in ROOMS:
                package, _, name = room.rpartition(".")
                if room in compiled:
                    setattr(sys.modules[package], name, compiled[room])

    return load
