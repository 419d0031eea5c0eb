"""Measure error rates as the FVC did, on synthetic prints: two matchers on the same templates.

    python examples/evaluate_synthetic.py [FOLDER FOR THE PRINTS [FINGERS [IMPRESSIONS]]]

The prints are made once; a second run finds them. A handful of fingers says little about a matcher:
with 100 fingers and 8 impressions the rates begin to mean something.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fpmatch.evaluation.run import evaluate_matchers
from fpmatch.synthesis.database import make_database


def main(folder: Path, fingers: int, impressions: int) -> None:
    """Make the prints, compare each with each, and print how often either matcher errs."""
    made = make_database(folder, fingers=fingers, impressions=impressions, preset="clean", seed=3)
    print(f"{made.fingers} fingers, {made.impressions} impressions of each: {made.folder}")

    # "extended": all pairs of one finger, and all pairs of impressions of different fingers
    reports = evaluate_matchers([folder], ["unit-circle", "paper"], protocol="extended")
    (first,) = reports[0].sets
    print(f"{first.genuine} genuine pairs, {first.impostor} impostor pairs")
    for report in reports:
        (row,) = report.sets
        genuine = row.outcomes["similarity"][row.pairs.genuine]
        impostor = row.outcomes["similarity"][~row.pairs.genuine]
        print()
        print(f"matcher {report.matcher}")
        print(f"  equal error rate                     {shown(row.rates.eer)}")
        print(f"  genuine refused, no impostor let in  {shown(row.rates.zero_fmr)}")
        # raw similarities: their order alone has meaning, and each matcher has a scale of its own
        print(f"  least alike of the genuine            {genuine.min():.3f}")
        print(f"  most alike of the impostors           {impostor.max():.3f}")


def shown(rate: float | None) -> str:
    """Return a rate in percent, or a dash where the pairs are too few to tell it."""
    return "-" if rate is None else f"{100 * rate:.1f} %"


if __name__ == "__main__":
    place, *counts = sys.argv[1:] or ["out/examples/prints"]
    main(Path(place), *[int(n) for n in counts] + [4, 3][len(counts) :])
