"""Run the commands of pages, and follow the links of those at the root: see `scripts/check_pages`.

A page becomes one shell script, in which each command stands on the line that it has in the page.
The page's folder has the sample prints, the examples, and what stands for a reader's own files:
`INPUTS`, and a small database of synthetic prints, `DATABASE`. What else a page takes for granted
stands in it as a comment that begins with ``<!-- sh``, which runs, too.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
PAGES: Final = ("README.md", "docs/tutorial/*.md", "docs/how-to/*.md")
FOLDERS: Final = ("sample_data", "examples", "docs/how-to/one_file")
INPUTS: Final = {
    "probe.tif": "101_1.tif",
    "reference.tif": "101_3.tif",
    "a.tif": "101_1.tif",
    "b.tif": "101_3.tif",
}
DATABASE: Final = "fvc/fvc2002/DB1_B"
MADE: Final = (
    "--fingers",
    "16",
    "--impressions",
    "3",
    "--seed",
    "7",
)  # the least to calibrate with
SECONDS: Final = 300  # for one page
BEGIN: Final = re.compile(r"(\s*)(?:```(sh|python)|<!-- (sh))\s*$")
LINK: Final = re.compile(r"\]\(([^)\s]+)\)")

# `verify` answers "no match" and "inconclusive" by its exit status. A server runs until it is
# stopped: one in the foreground ends once it has said where it listens.
SHELL: Final = r"""
set -uo pipefail
trap 'echo "$LINENO $?" >>"$FAILURES"' ERR
pip() { echo "pip: a page installs nothing here" >&2; return 1; }
fpmatch() {
    local status=0
    if [[ $BASHPID != "$$" ]]; then exec fpmatch "$@"; fi # in the background, or in a pipe
    if [[ ${1:-} == serve ]]; then
        command fpmatch "$@" --port 0 >serve.log 2>&1 &
        for _ in {1..300}; do
            grep -q 'http://' serve.log && break
            sleep .1
        done
        kill -INT $!
        wait $! || status=$?
        return $((status == 130 ? 0 : status))
    fi
    command fpmatch "$@" || status=$?
    [[ ${1:-} == verify && ($status == 1 || $status == 3) ]] || return "$status"
}
"""


def script_of(text: str) -> str:
    """Return the commands of a page, each on its line, as one shell script."""
    lines, language, end, indent = [], "", "", ""
    for line in text.splitlines():
        if not language and (begin := BEGIN.match(line)):
            indent, language, end = begin[1], begin[2] or begin[3], "```" if begin[2] else "-->"
            lines.append("python -W error - <<'PYTHON'" if language == "python" else "")
        elif language and line.strip() == end:
            lines.append("PYTHON" if language == "python" else "")
            language = ""
        else:
            lines.append(line.removeprefix(indent) if language else "")
    return "\n".join(lines) + "\n"


def run(page: Path, common: Path) -> tuple[list[str], str, float]:
    """Run the commands of a page; return those that fail, what was printed, and the seconds."""
    name = page.relative_to(ROOT).as_posix() if page.is_relative_to(ROOT) else str(page)
    text, start = page.read_text("utf-8"), time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        shell, script, failures = (Path(folder, one) for one in ("shell", "script", "failures"))
        shutil.copytree(common, Path(folder, "page"))
        shell.write_text(SHELL, encoding="utf-8")
        script.write_text(script_of(text), encoding="utf-8")
        failures.touch()
        given = {"HOME": str(common.parent), "BASH_ENV": str(shell), "FAILURES": str(failures)}
        printed, ended = execute(["bash", str(script)], Path(folder, "page"), given)
        lines = [line.split() for line in failures.read_text("utf-8").splitlines()]
    shown = ["", *text.splitlines()]
    failed = [f"{name}:{n}: exit status {status}: {shown[int(n)].strip()}" for n, status in lines]
    failed += [] if ended else [f"{name}: takes more than {SECONDS} s"]
    return failed, printed, time.monotonic() - start


def execute(command: list[str], folder: Path, given: dict[str, str]) -> tuple[str, bool]:
    """Run a command with the `fpmatch` beside this Python, and stop all that it started.

    Return what it printed, and whether it ended in time.
    """
    own = {name: value for name, value in os.environ.items() if not name.startswith("FPMATCH_")}
    paths = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    with tempfile.TemporaryFile() as printed:
        process = subprocess.Popen(
            command,
            cwd=folder,
            env={**own, **given, "PATH": paths},
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            ended = process.wait(SECONDS) is not None
        except subprocess.TimeoutExpired:
            ended = False
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        printed.seek(0)
        return printed.read().decode(errors="replace"), ended


def make_inputs(folder: Path) -> None:
    """Fill the folder that each page gets a copy of."""
    for name in FOLDERS:
        shutil.copytree(ROOT / name, folder / name)
    for name, sample in INPUTS.items():
        shutil.copy(ROOT / "sample_data" / sample, folder / name)
    Path(folder, DATABASE).parent.mkdir(parents=True)
    execute(["fpmatch", "synth", DATABASE, *MADE], folder, {})


def dead_links(page: Path) -> list[str]:
    """Return the links of a page to files that are not there."""
    missing = []
    for number, line in enumerate(page.read_text("utf-8").splitlines(), start=1):
        for link in LINK.findall(line):
            path = link.partition("#")[0]
            if "://" not in link and path and not (page.parent / path).exists():
                missing.append(f"{page.name}:{number}: no such file: {path}")
    return missing


def main(names: list[str]) -> int:
    """Check the pages that are named, else all."""
    pages = [Path(name).resolve() for name in names]
    pages = pages or [path for pattern in PAGES for path in sorted(ROOT.glob(pattern))]
    failed = [link for page in sorted(ROOT.glob("*.md")) for link in dead_links(page)]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        make_inputs(common := Path(folder, "common"))
        results = pool.map(partial(run, common=common), pages)
        for page, (failures, printed, seconds) in zip(pages, results, strict=True):
            print(f"{page.name}: {seconds:.1f} s", file=sys.stderr)
            if failures:
                print(printed, file=sys.stderr)
            failed += failures
    print(*failed, sep="\n", end="\n" * bool(failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
