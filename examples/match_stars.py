"""Find where a picture of stars lies in a catalogue: bare points, no fingerprints.

python examples/match_stars.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fpmatch import match_points
from fpmatch.formats.points_csv import load_points

SAMPLES = Path(__file__).resolve().parent.parent / "sample_data"


def main() -> None:
    """Match the stars with the catalogue, then with a sky that has nothing of them."""
    stars, catalogue = load_points(SAMPLES / "stars.csv"), load_points(SAMPLES / "catalogue.csv")
    print(f"{len(stars)} stars, {len(catalogue)} in the catalogue")

    match = match_points(stars, catalogue)
    if match.transform is None:
        print("no match")
        return
    move = match.transform
    print(f"found {len(match.pairs)} of them, {match.rms:.1f} apart from their places (rms)")
    print(f"scale {move.scale:.4f}, turned by {move.rotation_deg:.2f}°, ", end="")
    print(f"shifted by ({move.tx:.1f}, {move.ty:.1f})")
    print(f"matches as good expected by chance: {match.chance:.1e}")

    # The transform tells where to look for what the picture has and no pair explains.
    missing = np.setdiff1d(np.arange(len(stars)), match.pairs[:, 0])
    for number, (x, y) in zip(missing, move.apply(stars[missing]), strict=True):
        print(f"  star {number} is not in the catalogue, at ({x:.0f}, {y:.0f}) there")

    # Where there is nothing to find, that is the answer.
    low, high = catalogue.min(axis=0), catalogue.max(axis=0)
    strange = np.random.default_rng(1).uniform(low, high, catalogue.shape)
    found = match_points(stars, strange).transform
    print(f"in a sky of random points: {'no match' if found is None else 'a match'}")


if __name__ == "__main__":
    main()
