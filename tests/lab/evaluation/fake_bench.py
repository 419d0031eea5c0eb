"""A matcher and an extractor whose answers are known; a module, so that workers can import it."""

import numpy as np

from fpmatch.errors import ImageReadError
from fpmatch.matching.result import Comparison, Matcher
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, Template

SPREAD = 30.0


def write_database(folder, fingers=5, impressions=4, contents=None, toml=None):
    """Write a database of prints that `extractor` understands; `contents` are those of stems."""
    folder.mkdir()
    for stem in (f"{f}_{n}" for f in range(1, fingers + 1) for n in range(1, impressions + 1)):
        (folder / f"{stem}.tif").write_text((contents or {}).get(stem, "print"))
    if toml is not None:
        (folder / "dataset.toml").write_text(toml)
    return folder


def extractor(path, dpi):
    """Place one minutia near 100 times the finger's number; obey what the file says."""
    content = path.read_text()
    if content == "broken":
        raise ImageReadError(f"{path}: broken")
    if content == "empty":
        return Template(Minutiae.empty(), 10, 10)
    finger, number = map(int, path.stem.split("_"))
    x = 100 * finger + SPREAD * np.random.default_rng([finger, number]).standard_normal()
    return Template(Minutiae([x], [0.0], [0.0]), 10, 10, dpi or 500.0)


class Fake(Matcher):
    """Call prints alike that lie near each other; find no transform beyond 200 px."""

    name = "fake"

    def prepare(self, template):
        return float(template.minutiae.x[0])

    def compare(self, probe, reference):
        apart = abs(probe - reference)
        far = apart > 200
        return Comparison(
            similarity=1 / (1 + apart),
            transform=None if far else Similarity(1.0, 0.1, reference - probe, 0.0),
            pairs=np.zeros((0 if far else 1, 2), np.int32),
            rms_px=float("nan") if far else 0.0,
            agreement=0.0 if far else 1.0,
            overlap=0.0 if far else 1.0,
            reason="too far" if far else "",
        )


MATCHER = Fake()
