"""Find the position of an image of stars in a catalogue: bare points, no fingerprints.

python examples/match_stars.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fpmatch import match_points
from fpmatch.lab.points.points_csv import load_table

SAMPLES = Path(__file__).resolve().parent.parent / "sample_data"


def main() -> None:
    """Match the stars with the catalogue, then with random points."""
    files = SAMPLES / "stars.csv", SAMPLES / "catalogue.csv"
    stars, catalogue = (load_table(file).points for file in files)
    print(f"{len(stars)} stars, {len(catalogue)} in the catalogue")

    match = match_points(stars, catalogue)
    if match.transform is None:
        print("no match")
        return
    move = match.transform
    print(f"found {len(match.pairs)} of them, residual {match.rms:.1f} (rms)")
    print(f"scale {move.scale:.4f}, rotation {move.rotation_deg:.2f}°, ", end="")
    print(f"shift ({move.tx:.1f}, {move.ty:.1f})")
    print(f"matches as good expected by chance: {match.chance:.1e}")

    # The transform predicts the positions of the stars without a partner.
    missing = np.setdiff1d(np.arange(len(stars)), match.pairs[:, 0])
    for number, (x, y) in zip(missing, move.apply(stars[missing]), strict=True):
        print(f"  star {number} is not in the catalogue, at ({x:.0f}, {y:.0f}) there")

    low, high = catalogue.min(axis=0), catalogue.max(axis=0)
    unrelated = np.random.default_rng(1).uniform(low, high, catalogue.shape)
    found = match_points(stars, unrelated).transform
    print(f"in a sky of random points: {'no match' if found is None else 'a match'}")


if __name__ == "__main__":
    main()
