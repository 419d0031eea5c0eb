"""Compile the kernels where a compiler is found; the package works, slower, without.

All other metadata is in pyproject.toml. Set ``FPMATCH_NO_COMPILE=1`` to leave the kernels
interpreted on purpose, and ``FPMATCH_REQUIRE_KERNELS=1`` to fail where they cannot be compiled.
``FPMATCH_SANITIZE=1`` instruments them with GCC's sanitizers of addresses and undefined behaviour,
for ``scripts/fuzz --sanitize``.
"""

import os
import sys
from pathlib import Path

from setuptools import Extension, setup

PACKAGE = Path("fpmatch")
# A kernel is a file that says so in its name: `_something_kernel.py`.
KERNELS = sorted(PACKAGE.rglob("_*_kernel.py"))
# Cython's own code for memory views, compiled once instead of in each kernel: 45 s instead of 140.
SHARED = "fpmatch._cython_shared"
C_FILES = Path("build/cython")
# -g0: Python's own flags ask for debugging data, which cost the compiler time and are not used.
COMPILE_ARGS = (
    [] if sys.platform == "win32" else ["-O3", "-g0", "-ffp-contract=off", "-fno-math-errno"]
)
SANITIZE_ARGS = ["-fsanitize=address,undefined", "-fno-sanitize=alignment,vptr", "-O1", "-g1"]
SANITIZE_ARGS += ["-fno-omit-frame-pointer", "-fno-sanitize-recover=all"]


def extensions() -> list[Extension]:
    """Return the optional extension modules, none where they are unwanted or Cython is missing."""
    if os.environ.get("FPMATCH_NO_COMPILE"):
        return []
    try:
        from Cython.Build import cythonize  # noqa: PLC0415
    except ImportError:
        return []
    sources = {".".join(path.with_suffix("").parts): path.as_posix() for path in KERNELS}
    sanitize = SANITIZE_ARGS if os.environ.get("FPMATCH_SANITIZE") else []
    sources[SHARED] = SHARED.replace(".", "/") + ".c"
    # Cython misses a declaration that is imported over several lines, so a new one renews all.
    changed = max(file.stat().st_mtime for file in (*PACKAGE.rglob("*.pxd"), Path("setup.py")))
    made = [file for kernel in KERNELS if (file := (C_FILES / kernel).with_suffix(".c")).exists()]
    modules = cythonize(
        [
            Extension(
                name,
                [path],
                extra_compile_args=[*COMPILE_ARGS, *sanitize],
                extra_link_args=sanitize,
            )
            for name, path in sources.items()
        ],
        shared_utility_qualified_name=SHARED,
        build_dir=str(C_FILES),
        force=any(file.stat().st_mtime < changed for file in made),
        language_level=3,
        compiler_directives={
            "boundscheck": False,
            "wraparound": False,
            "cdivision": True,
            "initializedcheck": False,
            # A local variable has the type of what is assigned to it, unless it is annotated.
            "infer_types": True,
            # Module variables are constants; objects with scratch arrays serve one thread each.
            "freethreading_compatible": True,
        },
    )
    for module in modules:
        # Set here: cythonize makes new extensions and drops it.
        module.optional = not os.environ.get("FPMATCH_REQUIRE_KERNELS")
    return modules


setup(
    ext_modules=extensions(),
    options={"build_ext": {"parallel": True}},
)
