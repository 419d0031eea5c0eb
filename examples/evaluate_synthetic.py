"""Measure error rates on synthetic prints by a protocol of the FVC: two matchers, same templates.

    python examples/evaluate_synthetic.py [FOLDER FOR THE PRINTS [FINGERS [IMPRESSIONS]]]

The prints are made once; a second run reuses them. A few fingers do not suffice to measure a
matcher; use at least 100 fingers and 8 impressions.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fpmatch.lab.evaluation.rates.scores import split
from fpmatch.lab.evaluation.run import evaluate_matchers
from fpmatch.lab.synthesis.database import make_database
from fpmatch.lab.synthesis.presets import PRESETS


def main(folder: Path, fingers: int, impressions: int) -> None:
    """Make the prints, compare all pairs, and print the error rates of both matchers."""
    preset = PRESETS["clean"]
    made = make_database(folder, fingers=fingers, impressions=impressions, preset=preset, seed=3)
    print(f"{made.fingers} fingers, {made.impressions} impressions of each: {made.folder}")

    # "extended": all pairs of one finger, and all pairs of impressions of different fingers
    reports = evaluate_matchers([folder], ["unit-circle", "paper"], protocol="extended")
    print(f"{reports[0].genuine} genuine pairs, {reports[0].impostor} impostor pairs")
    for report in reports:
        (row,) = report.sets
        genuine, impostor = split([row.scores.trials])
        print()
        print(f"matcher {report.matcher}")
        print(f"  equal error rate                     {shown(row.rates.eer)}")
        print(f"  ZeroFMR                              {shown(row.rates.zero_fmr)}")
        # similarities: only their order has a meaning, and each matcher has its own scale
        print(f"  least similarity, genuine             {genuine.min():.3f}")
        print(f"  greatest similarity, impostor         {impostor.max():.3f}")


def shown(rate: float | None) -> str:
    """Return a rate in percent, or a dash where there are too few pairs."""
    return "-" if rate is None else f"{100 * rate:.1f} %"


if __name__ == "__main__":
    place, *counts = sys.argv[1:] or ["out/examples/prints"]
    main(Path(place), *[int(n) for n in counts] + [4, 3][len(counts) :])
