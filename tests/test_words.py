"""Words that the code avoids: they say nothing about the thing that they name."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
NAMES = "fpmatch", "research", "benchmarks", "docs"
FOLDERS = [path for path in map(ROOT.joinpath, NAMES) if path.exists()]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_a_docstring_says_what_a_class_is_and_not_that_it_holds_something(folder):
    classes = [
        (path.name, node.name, ast.get_docstring(node) or "")
        for path in sorted(folder.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
    ]
    assert classes
    assert [one for one in classes if one[2].startswith("Hold")] == []


def names_in(function):
    """Return the names of parameters and variables of a function."""
    nodes = [*ast.walk(function)]
    variables = {node.id for node in nodes if isinstance(node, ast.Name)}
    return variables | {node.arg for node in nodes if isinstance(node, ast.arg)}


def test_a_variable_is_named_after_what_was_found():
    """Not yet in the kernels."""
    package = ROOT / "fpmatch"
    functions = [
        (path.name, node.name, names_in(node))
        for path in sorted(package.rglob("*.py"))
        if not path.stem.endswith("_kernel")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
    ]
    assert [one[:2] for one in functions if "found" in one[2]] == []
