"""Words that the code avoids: they say nothing about the thing that they name."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = [
    ROOT / name for name in ("fpmatch", "research", "benchmarks", "docs") if (ROOT / name).exists()
]


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
