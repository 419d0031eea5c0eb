"""Compile the kernels where a compiler is found; the package works, slower, without.

All other metadata is in pyproject.toml. Set ``FPMATCH_NO_COMPILE=1`` to leave the kernels
interpreted on purpose, and ``FPMATCH_REQUIRE_KERNELS=1`` to fail where they cannot be compiled.
``FPMATCH_SANITIZE=1`` instruments them with GCC's sanitizers of addresses and undefined behaviour,
for ``scripts/fuzz --sanitize``.
"""

import os
import re
import runpy
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

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


class CopyAll(build_ext):
    """With ``--inplace``, replace files that are newer than those built, too."""

    def copy_extensions_to_source(self) -> None:
        """Copy all that was built into the package."""
        self.force = True
        super().copy_extensions_to_source()


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
    statements = sources_statements()
    for file, statement in statements.items():
        if file.exists() and statement not in file.read_text("utf-8"):
            file.unlink()  # Cython itself compares times only
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
    for file, statement in statements.items():
        if statement not in (text := file.read_text("utf-8")):
            file.write_text(text + statement, "utf-8")
    for module in modules:
        # Set here: cythonize makes new extensions and drops it.
        module.optional = not os.environ.get("FPMATCH_REQUIRE_KERNELS")
    return modules


def sources_of(kernel: Path) -> set[Path]:
    """Return a kernel's two files, and each ``.pxd`` file that one of these names.

    Cython's own list lacks a file that is imported as ``from cython.cimports.package import name``.
    """
    declarations = {path.stem: path for path in PACKAGE.rglob("*.pxd")}
    found, new = set(), {kernel, kernel.with_suffix(".pxd")}
    while new:
        found |= new
        texts = [path.read_text("utf-8") for path in new if path.exists()]
        words = {word for text in texts for word in re.findall(r"\w+", text)}
        new = {declarations[word] for word in words & declarations.keys()} - found
    return found


def sources_statements() -> dict[Path, str]:
    """Return the lines that let each C file, and what is compiled from it, state its sources.

    A comment states what else the C file depends on: Cython and this file.
    """
    from Cython import __version__  # noqa: PLC0415

    functions = runpy.run_path(str(PACKAGE / "base" / "kernels.py"))
    tools = f"Cython {__version__}, setup.py {functions['digest'](Path('setup.py'))}"
    found = {(C_FILES / SHARED.replace(".", "/")).with_suffix(".c"): f"\n/* {tools} */\n"}
    for kernel in KERNELS:
        text = functions["sources_statement"](sources_of(kernel), PACKAGE)
        declared = f'Py_EXPORTED_SYMBOL const char fpmatch{kernel.stem}_sources[] = "{text}";'
        found[(C_FILES / kernel).with_suffix(".c")] = f"\n/* {tools} */\n{declared}\n"
    return found


setup(
    ext_modules=extensions(),
    cmdclass={"build_ext": CopyAll},
    options={"build_ext": {"parallel": True}},
)
