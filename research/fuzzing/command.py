"""The command ``fuzz``."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.output import check_writable
from research.commands import PATH, Command, json_file, write_json
from research.fuzzing.loop import Count, run
from research.fuzzing.targets import all_targets

if TYPE_CHECKING:
    from pathlib import Path

SECONDS: Final = 60.0


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  python -m research fuzz --seconds 120
  python -m research fuzz --seconds 60 --target iso2005 --target an2 my.iso their.an2
""",
)
@click.argument("files", metavar="[FILE]...", nargs=-1, type=PATH)
@click.option("--seconds", type=float, help="For all targets together.  [default: 60]")
@click.option("--files", "count", type=int, metavar="N", help="Damaged files for each target.")
@click.option("--target", "names", multiple=True, help="Only this target (repeatable).")
@click.option("--seed", default=0, show_default=True, help="Another seed gives other inputs.")
@click.option("--into", type=PATH, default="out/fuzz", show_default=True, help="For failures.")
@json_file
@click.pass_context
def command(
    context: click.Context,
    files: tuple[Path, ...],
    seconds: float | None,
    count: int | None,
    names: tuple[str, ...],
    seed: int,
    into: Path,
    json_file: Path | None,
) -> None:
    """Feed damaged files to every reader of templates and images.

    A reader may read a file or refuse it by one of fpmatch's own errors. Anything else, such as a
    crash, a minute without an end or 2 GB of memory, is a failure: the input is saved and named,
    and the exit status is 1. Each FILE is another file to damage; a saved input shows whether it
    still fails. The time is shared evenly among the targets; with --files each gets so many damaged
    files, however long it takes.
    """
    known = [target.name for target in all_targets()]
    if count is not None and seconds is not None:
        raise click.UsageError("--seconds and --files exclude one another")
    if unknown := set(names) - set(known):
        raise click.BadParameter(f"{min(unknown)!r} is none of {', '.join(known)}")
    extra = [path.read_bytes() for path in files]
    if json_file:
        check_writable(json_file)
    chosen = names or known
    share = math.inf if count else (seconds or SECONDS) / len(chosen)
    start, counts = time.monotonic(), {}
    for name in chosen:
        counts[name] = found = run(
            name, all_targets, extra, seed, into, seconds=share, files=count or math.inf
        )
        click.echo(_in_words(name, found))
        for path, reason in found.failures:
            click.echo(f"  {path}: {reason}")
    total = sum(found.inputs for found in counts.values())
    failures = sum(len(found.failures) for found in counts.values())
    passed = time.monotonic() - start
    click.echo(f"{total} inputs, {failures} failures, {passed:.1f} s, seed {seed}")
    if json_file:
        targets = [_as_json(name, found) for name, found in counts.items()]
        write_json(json_file, {"seed": seed, "failures": failures, "targets": targets})
    context.exit(1 if failures else 0)


def _in_words(name: str, count: Count) -> str:
    """Return a line that sums up the inputs of a target."""
    return (
        f"{name:<16} {count.inputs:>8} inputs, {count.inputs - count.refused:>8} read, "
        f"{len(count.failures)} failures, {count.seconds:.1f} s, slowest {count.slowest_ms} ms, "
        f"{count.peak_mb} MB"
    )


def _as_json(name: str, count: Count) -> dict[str, Any]:
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
