"""Score, be killed at a random moment, score again: is it the file of an undisturbed run?

    scoring_kills.py FOLDER KILLS

A program of its own: it has one thread, so that it can fork, and kill what it forked.
"""

import os
import random
import signal
import sys
import time
from pathlib import Path

from scoring_fakes import Line, Near

from fpmatch.gallery.batch import unfinished
from fpmatch.gallery.batch.plan import AllPairs
from fpmatch.gallery.batch.score import score
from fpmatch.gallery.engine.workers import no_progress

REFERENCES = Line([3.0 * n for n in range(9)], "reference")
PROBES = Line([5.0, None, 8.5, 20.0], "probe")
PLAN = AllPairs(4, 9, band=3, pairs_per_chunk=3)


unfinished.SAVE_EVERY_S = 0  # at each chunk


def run(output, progress=no_progress):
    options = {"pairs": PLAN, "matcher": Near(0.001)}
    return score(REFERENCES, PROBES, output, **options, progress=progress)


def run_in_child(output):
    """Score in a child; return its id, and a pipe that gets a byte at each step of its progress."""
    steps, told = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(steps)
        run(output, lambda *_: os.write(told, b"."))
        os._exit(0)
    os.close(told)
    return child, steps


def main(folder, kills):
    rng = random.Random(7)
    undisturbed = folder / "undisturbed.csv"
    made = []
    run(undisturbed, lambda *step: made.append(step))
    resumed = 0
    for kill in range(kills):
        output = folder / f"killed{kill}.csv"
        child, steps = run_in_child(output)
        # by its own steps, not by the clock: how fast it runs depends on what else runs
        for _ in range(rng.randrange(len(made))):
            os.read(steps, 1)
        time.sleep(rng.uniform(0, 0.002))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(steps)
        done = run(output)
        resumed += done.resumed
        assert output.read_bytes() == undisturbed.read_bytes(), output
        assert done.pairs == 36
        assert done.failed_pairs == 9
    left = {p.name for p in folder.iterdir()}
    assert len(left) == kills + 1, left
    sys.stdout.write(f"{resumed}\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
