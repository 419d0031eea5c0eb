"""What the tests of evaluations share: helper modules beside them, and one evaluation."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))


@pytest.fixture
def options(bench):
    return {"matcher": bench.MATCHER, "extractor": bench.extractor, "workers": 1}


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """Return the evaluation of two databases by the fake matcher; one print has no template."""
    import fake_bench

    from fpmatch.lab.evaluation.run import evaluate

    root = tmp_path_factory.mktemp("evaluated")
    toml, broken = 'name = "set, one"', {"1_2": "broken"}
    folders = [
        fake_bench.write_database(root / "a", 8, 3, contents=broken, toml=toml),
        fake_bench.write_database(root / "b", 6),
    ]
    return evaluate(folders, matcher=fake_bench.MATCHER, extractor=fake_bench.extractor, workers=1)
