"""Run the benchmarks and show every figure beside its target; see ``scripts/bench``."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from figures import measured_figures

HERE = Path(__file__).resolve().parent
PYTEST = (
    *("-m", "pytest", str(HERE), "-q", "--no-header", "-p", "no:cacheprovider", "-p", "no:xdist"),
    *("-o", "python_files=bench_*.py", "-o", "filterwarnings=default", "--benchmark-quiet"),
    "--benchmark-save-data",
)


def main() -> int:
    """Run the script; return its exit status: 1 where a figure misses its target."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to this file")
    parser.add_argument("-k", metavar="WORDS", help="those benchmarks alone, as pytest takes it")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        raw = Path(folder, "raw.json")
        words = [sys.executable, *PYTEST, f"--benchmark-json={raw}"]
        words += ["-k", options.k] if options.k else []
        done = subprocess.run(words, check=False, stdout=sys.stderr)
        if done.returncode or not raw.exists():
            return 2
        figures = measured_figures(json.loads(raw.read_text(encoding="utf-8"))["benchmarks"])
    for figure in figures:
        print(
            f"{'ok    ' if figure['ok'] else 'MISSED'}  {figure['name']:<40}"
            f"{figure['value']:>8.3g} {figure['unit']:<15}{figure['target']:<8}"
            f"{figure['ours']:>9} beside {figure['yardstick']}"
        )
    if options.json:
        text = json.dumps({"figures": figures}, indent=1, ensure_ascii=False)
        options.json.write_text(f"{text}\n", encoding="utf-8")
    return 0 if all(figure["ok"] for figure in figures) else 1


if __name__ == "__main__":
    sys.exit(main())
