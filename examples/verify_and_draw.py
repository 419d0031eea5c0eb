"""Verify two prints, and draw the overlay.

python examples/verify_and_draw.py [FOLDER FOR THE PICTURES]
"""

from __future__ import annotations

import sys
from pathlib import Path

from fpmatch import extract, read_image, verify

SAMPLES = Path(__file__).resolve().parent.parent / "sample_data"


def main(folder: Path) -> None:
    """Compare a print with another of the same finger, and with one of another finger."""
    folder.mkdir(parents=True, exist_ok=True)
    template = extract(read_image(SAMPLES / "101_1.tif"))  # once, for both comparisons
    print(f"probe 101_1: {len(template.minutiae)} minutiae, {template.dpi:g} dpi")

    for name in ("101_3", "102_1"):
        reference = read_image(SAMPLES / f"{name}.tif")
        result = verify(template, reference)
        print()
        print(f"against {name}: {result.decision}")
        print(f"  score {result.score:.1f}, a match needs {result.threshold:.1f}")
        if result.match and result.transform is not None:
            print(f"  {len(result.pairs)} pairs of minutiae, {result.rms_px:.1f} px apart (rms)")
            # a positive θ is clockwise on screen, because y points down
            turn = result.transform.rotation_deg
            sense = "clockwise" if turn > 0 else "counter-clockwise"
            print(f"  rotation of the probe: {abs(turn):.0f}° {sense}")
        else:
            print(f"  reason: {result.reason}")
        picture = folder / f"101_1_on_{name}.png"
        result.overlay().save(picture)
        print(f"  overlay: {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/examples"))
