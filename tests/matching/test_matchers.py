import subprocess
import sys

import pytest

from fpmatch.errors import MatcherError
from fpmatch.matching import matchers
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher, matcher_names

THIRD = """
class Third:
    name = "third-way"
MATCHER = Third()
"""


@pytest.fixture
def third_matcher(tmp_path, monkeypatch):
    """Drop a third matcher, and a private kernel, beside those of the package."""
    (tmp_path / "third_way.py").write_text(THIRD)
    (tmp_path / "_third_kernel.py").write_text("")
    monkeypatch.setattr(matchers, "__path__", [*matchers.__path__, str(tmp_path)])
    yield
    sys.modules.pop(f"{matchers.__name__}.third_way", None)


@pytest.mark.usefixtures("third_matcher")
def test_matcher_is_found_by_its_file_name():
    names = matcher_names()
    assert [get_matcher(name).name for name in names] == names == sorted(names)
    assert {"third-way", "unit-circle"} < set(names)
    assert DEFAULT_MATCHER == "unit-circle"
    assert not [name for name in names if name.startswith(("-", "_")) or "kernel" in name]
    assert get_matcher("third-way") is get_matcher("third-way")


@pytest.mark.usefixtures("third_matcher")
@pytest.mark.parametrize("name", ["nobody", "", "third_way", "-third-kernel", "_third_kernel"])
def test_unknown_matcher_names_the_known(name):
    with pytest.raises(MatcherError, match=r"known: .*third-way") as caught:
        get_matcher(name)
    assert repr(name) in str(caught.value)


def test_listing_names_imports_no_matcher():
    program = (
        "import sys; from fpmatch.matching import registry; registry.matcher_names();"
        "print([m for m in sys.modules if m.startswith('fpmatch.matching.matchers.')])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
