"""Score, be killed at a random moment, score again: is it the file of an undisturbed run?

    scoring_kills.py FOLDER SUFFIX KILLS

A program of its own: it has one thread, so that it can fork, and kill what it forked.
"""

import os
import random
import signal
import sys
import time
from pathlib import Path

from scoring_fakes import Line, Near

from fpmatch.evaluation.scoring import score
from fpmatch.evaluation.scoring_plan import AllPairs

REFERENCES = Line([3.0 * n for n in range(9)], "reference")
PROBES = Line([5.0, None, 8.5, 20.0], "probe")
PLAN = AllPairs(4, 9, band=3, pairs_per_chunk=3)


def run(output):
    return score(REFERENCES, PROBES, output, pairs=PLAN, matcher=Near(0.001), save_every_s=0)


def main(folder, suffix, kills):
    rng = random.Random(7)
    undisturbed = folder / f"undisturbed{suffix}"
    begin = time.monotonic()
    run(undisturbed)
    seconds = time.monotonic() - begin
    resumed = 0
    for kill in range(kills):
        output = folder / f"killed{kill}{suffix}"
        child = os.fork()
        if child == 0:
            run(output)
            os._exit(0)
        time.sleep(rng.uniform(0, seconds))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        done = run(output)
        resumed += done.resumed
        assert output.read_bytes() == undisturbed.read_bytes(), output
        assert done.pairs == 36
        assert done.failed_pairs == 9
    left = {p.name for p in folder.iterdir()}
    assert len(left) == kills + 1, left
    sys.stdout.write(f"{resumed}\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]))
