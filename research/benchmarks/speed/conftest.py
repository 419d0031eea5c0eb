"""What the benchmarks share: a print, prepared prints, and yardsticks to measure beside them."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import pytest
from scipy.spatial import Delaunay

from fpmatch.gallery.engine.worker import single_threaded
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from fpmatch.image.io.read import GreyImage
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.templates.minutiae import Template

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
SAMPLE = ROOT / "sample_data"
POINTS = 40

sys.path += [str(ROOT), str(HERE.parent), str(HERE)]

from made_prints import prints  # noqa: E402


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    with single_threaded():
        yield


@pytest.fixture(scope="session")
def image() -> GreyImage:
    """Return a print of 388 x 374 pixels at 500 dpi."""
    read = read_image(SAMPLE / "101_1.tif")
    assert read.pixels.shape == (374, 388)
    assert read.dpi == 500
    return read


@pytest.fixture(scope="session")
def templates() -> dict[str, Template]:
    """Return the templates of the sample prints, four each of four fingers, by name."""
    return {path.stem: extract(path) for path in sorted(SAMPLE.glob("*_*.tif"))}


@pytest.fixture(scope="session")
def nist_minutiae() -> list[Any]:
    """Return the same prints as NIST's mindtct extracts them, which bozorth3 compares."""
    nbis = pytest.importorskip("nbis", reason="extra fpmatch[bench]")
    plain = {"min_quality": 0.0, "get_center": False, "check_fingerprint": False}
    settings = nbis.NbisExtractorSettings(**plain, compute_nfiq2=False, ppi=500.0)
    extractor = nbis.new_nbis_extractor(settings)
    images = (read_image(path).pixels for path in sorted(SAMPLE.glob("*_*.tif")))
    return [extractor.extract_minutiae(cv2.imencode(".png", one)[1].tobytes()) for one in images]


@pytest.fixture(scope="session")
def prepared() -> list[PreparedTemplate]:
    """Return prepared prints of 40 minutiae, five of each finger."""
    return prints(np.random.default_rng(40), 50)


@pytest.fixture(scope="session")
def triangulations() -> Callable[[], object]:
    """Return what triangulates fifty sets of 40 points by scipy."""
    rng = np.random.default_rng(41)
    clouds = [rng.random((POINTS, 2)) for _ in range(50)]
    return lambda: [Delaunay(points) for points in clouds]


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """Return the environment of a process that keeps its bytecode, as an installed one does."""
    return {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}


@pytest.fixture(scope="session")
def command() -> list[str]:
    """Return the words that run fpmatch."""
    script = Path(sys.executable).with_name("fpmatch")
    return [str(script)] if script.exists() else [sys.executable, "-m", "fpmatch"]
