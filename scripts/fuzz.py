"""Feed damaged files to every reader of templates and images.

    scripts/fuzz --seconds 120
    scripts/fuzz --seconds 60 --target iso2005 --target an2 my.iso their.an2
    scripts/fuzz --files 100000 --json fuzz.json

A reader may read a file or refuse it by one of fpmatch's own errors. Anything else, a crash, a
minute without an end or 2 GB of memory, is a failure: the input is saved and named, and the exit
status is 1. Files given are begun from besides those that fpmatch writes itself; a saved input that
is given shows whether it fails still. The time is shared evenly among the targets, which
scripts/fuzz_targets.py lists; with --files each gets so many damaged files, however long it takes.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

from fuzz_loop import Count, run
from fuzz_targets import all_targets

SECONDS = 60.0


def main() -> int:
    """Run the script; return its exit status."""
    names = [target.name for target in all_targets()]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "files_given", metavar="FILE", nargs="*", type=Path, help="files to begin from"
    )
    amount = parser.add_mutually_exclusive_group()
    amount.add_argument(
        "--seconds", type=float, help=f"for all targets together [default: {SECONDS:g}]"
    )
    amount.add_argument("--files", type=int, metavar="N", help="damaged files for each target")
    parser.add_argument(
        "--target", action="append", choices=names, help="only this one (repeatable)"
    )
    parser.add_argument("--seed", type=int, default=0, help="another gives other inputs")
    parser.add_argument("--into", type=Path, default=Path("out/fuzz"), help="for failing inputs")
    parser.add_argument("--json", type=Path, metavar="FILE", help="for the counts")
    options = parser.parse_args()
    try:
        extra = [path.read_bytes() for path in options.files_given]
        if options.json:
            options.json.touch()
    except OSError as error:
        print(f"fuzz: {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    chosen = options.target or names
    share = math.inf if options.files else (options.seconds or SECONDS) / len(chosen)
    start, counts = time.monotonic(), {}
    for name in chosen:
        counts[name] = count = run(
            name,
            all_targets,
            extra,
            options.seed,
            options.into,
            seconds=share,
            files=options.files or math.inf,
        )
        print(in_words(name, count), flush=True)
        for path, reason in count.failures:
            print(f"  {path}: {reason}", flush=True)
    total = sum(count.inputs for count in counts.values())
    failures = sum(len(count.failures) for count in counts.values())
    print(
        f"{total} inputs, {failures} failures, {time.monotonic() - start:.1f} s, "
        f"seed {options.seed}"
    )
    if options.json:
        targets = [as_dict(name, count) for name, count in counts.items()]
        document = {"seed": options.seed, "failures": failures, "targets": targets}
        options.json.write_text(f"{json.dumps(document, indent=1)}\n", encoding="utf-8")
    return 1 if failures else 0


def in_words(name: str, count: Count) -> str:
    """Return a line of what became of a target's inputs."""
    return (
        f"{name:<16} {count.inputs:>8} inputs, {count.inputs - count.refused:>8} read, "
        f"{len(count.failures)} failures, {count.seconds:.1f} s, slowest {count.slowest_ms} ms, "
        f"{count.peak_mb} MB"
    )


def as_dict(name: str, count: Count) -> dict[str, Any]:
    """Return the same as JSON values."""
    return {
        "name": name,
        "inputs": count.inputs,
        "damaged": count.damaged,
        "refused": count.refused,
        "seconds": round(count.seconds, 1),
        "slowest_ms": count.slowest_ms,
        "peak_mb": count.peak_mb,
        "failures": [{"file": str(path), "reason": reason} for path, reason in count.failures],
    }


if __name__ == "__main__":
    sys.exit(main())
