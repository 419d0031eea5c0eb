"""Run the benchmarks and compare every result with its target; see ``scripts/bench``."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from measures import MEASURES, measured

HERE = Path(__file__).resolve().parent
PYTEST = (
    *("-m", "pytest", str(HERE), "-q", "--no-header", "-p", "no:cacheprovider", "-p", "no:xdist"),
    *("-o", "python_files=bench_*.py", "-o", "filterwarnings=default", "--benchmark-quiet"),
    "--benchmark-save-data",
)


def main() -> int:
    """Run the script; return its exit status: 1 where a measure misses its target."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__.splitlines()[0])
    help_ = "write the results to this file; with -k the others in it stay"
    parser.add_argument("--json", type=Path, metavar="FILE", help=help_)
    parser.add_argument("-k", metavar="WORDS", help="those benchmarks alone, as pytest takes it")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        raw = Path(folder, "raw.json")
        words = [sys.executable, *PYTEST, f"--benchmark-json={raw}"]
        words += ["-k", options.k] if options.k else []
        done = subprocess.run(words, check=False, stdout=sys.stderr)
        if done.returncode or not raw.exists():
            return 2
        measures = measured(json.loads(raw.read_text(encoding="utf-8"))["benchmarks"])
    for measure in measures:
        print(
            f"{'ok    ' if measure['ok'] else 'MISSED'}  {measure['name']:<40}"
            f"{measure['value']:>8.3g} {measure['unit']:<15}{measure['target']:<8}"
            f"{measure['ours']:>9} beside {measure['yardstick']}"
        )
    if options.json:
        figures = {measure["name"]: measure for measure in measures}
        if options.k and options.json.exists():
            before = json.loads(options.json.read_text(encoding="utf-8"))["figures"]
            figures = {one["name"]: one for one in before} | figures
        ordered = [figures[one.name] for one in MEASURES if one.name in figures]
        text = json.dumps({"figures": ordered}, indent=1, ensure_ascii=False)
        options.json.write_text(f"{text}\n", encoding="utf-8")
    return 0 if all(measure["ok"] for measure in measures) else 1


if __name__ == "__main__":
    sys.exit(main())
