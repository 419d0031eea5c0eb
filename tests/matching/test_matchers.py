import subprocess
import sys

import pytest

from fpmatch.errors import MatcherError
from fpmatch.matching.registry import DEFAULT_MATCHER, OWN_MATCHERS, get_matcher, matcher_names


def test_matchers_are_found_by_their_names():
    names = matcher_names()
    assert [get_matcher(name).name for name in names] == names == sorted(names)
    assert DEFAULT_MATCHER in OWN_MATCHERS
    assert set(OWN_MATCHERS) <= set(names)
    assert get_matcher("paper") is get_matcher("paper")


@pytest.mark.parametrize("name", ["nobody", "", "unit_circle", "_third_kernel"])
def test_unknown_matcher_names_the_known(name):
    with pytest.raises(MatcherError, match=r"known: .*unit-circle") as caught:
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
