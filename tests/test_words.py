"""Words that the code avoids: they say nothing about the thing that they name."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
NAMES = "fpmatch", "research", "benchmarks", "docs"
FOLDERS = [path for path in map(ROOT.joinpath, NAMES) if path.exists()]


def nodes_of(folder, kind):
    """Return the nodes of a kind in all Python files of a folder, each with its file."""
    files = sorted(folder.rglob("*.py"))
    trees = [(file, ast.parse(file.read_text(encoding="utf-8"))) for file in files]
    return [(f, node) for f, tree in trees for node in ast.walk(tree) if isinstance(node, kind)]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_a_docstring_says_what_a_class_is_and_not_that_it_holds_something(folder):
    classes = nodes_of(folder, ast.ClassDef)
    assert classes
    for file, node in classes:
        assert not (ast.get_docstring(node) or "").startswith("Hold"), (file, node.name)


def names_in(function):
    nodes = [*ast.walk(function)]
    variables = {node.id for node in nodes if isinstance(node, ast.Name)}
    return variables | {node.arg for node in nodes if isinstance(node, ast.arg)}


def test_a_variable_is_named_after_what_was_found():
    """Not yet in the kernels."""
    for file, node in nodes_of(ROOT / "fpmatch", ast.FunctionDef):
        kernel = file.stem.endswith("_kernel")
        assert kernel or "found" not in names_in(node), (file, node.name)
