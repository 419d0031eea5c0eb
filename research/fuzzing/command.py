"""The command ``fuzz``."""

from __future__ import annotations

import math
import sys
import time
from typing import TYPE_CHECKING, Any, Final

import click

from research.commands import PATH, Command, json_file, write_json
from research.fuzzing import campaign
from research.fuzzing.loop import Count, Limits, run
from research.fuzzing.sanitizer import run_sanitized
from research.fuzzing.targets import all_targets

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from research.fuzzing.targets.target import Reader, Target

SECONDS: Final = 60.0
PROGRESS_SECONDS: Final = 2.0


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  scripts/fuzz --seconds 300
  scripts/fuzz --seconds 60 --target iso2005 --target an2 my.iso their.an2
  scripts/fuzz --files 1000 --jobs 2 --log campaign.jsonl
  scripts/fuzz --sanitize --seconds 300
  scripts/fuzz out/fuzz/json-0123456789ab.bin
""",
)
@click.argument("files", metavar="[FILE]...", nargs=-1, type=PATH)
@click.option(
    "--seconds", type=click.FloatRange(0, min_open=True),
    help="For all targets together.  [default: 60]",
)  # fmt: skip
@click.option(
    "--files", "count", type=click.IntRange(1), metavar="N", help="Damaged files for each target."
)
@click.option("--target", "names", multiple=True, help="Only this target (repeatable).")
@click.option(
    "--seed", type=click.IntRange(0),
    help="Another seed gives other inputs.  [default: number of runs in the log, else 0]",
)  # fmt: skip
@click.option("--jobs", type=click.IntRange(1), default=1, show_default=True, help="Processes.")
@click.option("--into", type=PATH, default="out/fuzz", show_default=True, help="For findings.")
@click.option(
    "--sanitize", is_flag=True,
    help="Build the kernels with AddressSanitizer, and feed the targets that reach them.",
)  # fmt: skip
@click.option("--log", type=PATH, metavar="FILE", help="Add the counts to this file of JSON lines.")
@click.option("--list", "list_targets", is_flag=True, help="List the targets, and end.")
@json_file
@click.pass_context
def command(
    context: click.Context,
    files: tuple[Path, ...],
    seconds: float | None,
    count: int | None,
    names: tuple[str, ...],
    seed: int | None,
    jobs: int,
    into: Path,
    sanitize: bool,
    log: Path | None,
    list_targets: bool,
    json_file: Path | None,
) -> None:
    """Feed damaged files to every reader of files, requests and arrays.

    A reader may read an input or refuse it by one line, one of fpmatch's own errors. Anything else
    is a finding: another error, the end of the process, 5 seconds of work, 1 GB of memory, control
    characters in a line, or a search of a damaged gallery that returns other candidates without a
    word. The first input of each kind is saved with its traceback, and the exit status is 1.

    FILEs alone are read as they are, by the target that their names begin with, or by all: so a
    finding is replayed. With --seconds or --files each FILE is another file to damage. The time is
    shared evenly among the targets; with --files each gets so many inputs, however long it takes.
    """
    targets = all_targets()
    if list_targets:
        click.echo("\n".join(_described(target) for target in targets))
        return
    chosen = _choose(targets, names, kernels=sanitize)
    if count is not None and seconds is not None:
        raise click.UsageError("--seconds and --files exclude one another")
    if sanitize:
        run_sanitized(sys.argv[1:])
    if files and count is None and seconds is None:
        context.exit(replay(files, chosen if names else targets))
    earlier = campaign.read(log) if log else []
    chosen_seed = seed if seed is not None else len({one["run"] for one in earlier})
    extra = [path.read_bytes() for path in files]
    share = math.inf if count else jobs * (seconds or SECONDS) / len(chosen) / jobs
    limits = Limits(share, count or math.inf, **(SANITIZED if sanitize else {}))
    start, counts, name = time.monotonic(), {}, campaign.name_of_run()
    for target in chosen:
        counts[target.name] = found = _feed(target, extra, chosen_seed, limits, jobs)
        click.echo(_in_words(target.name, found))
        for finding in found.findings.values():
            path = finding.save(into)
            click.echo(f"  {path}: {finding.reason} ({finding.times} inputs)")
        if log:
            campaign.add(log, target, found, run=name, seed=chosen_seed, sanitized=sanitize)
    total = sum(found.inputs for found in counts.values())
    kinds = sum(len(found.findings) for found in counts.values())
    passed = time.monotonic() - start
    click.echo(f"{total} inputs, {kinds} findings, {passed:.1f} s, seed {chosen_seed}")
    if log:
        click.echo(campaign.totals(campaign.read(log)))
    if json_file:
        rows = [_as_json(name, found) for name, found in counts.items()]
        write_json(json_file, {"seed": chosen_seed, "findings": kinds, "targets": rows})
    context.exit(1 if kinds else 0)


SANITIZED: Final[dict[str, Any]] = {"hang_seconds": 60.0, "peak_mb": 4000}
"""Limits of instrumented code, which takes ten times as long, and keeps what is freed."""


def _choose(targets: Sequence[Target], names: Sequence[str], *, kernels: bool) -> list[Target]:
    """Return the targets of these names, or all; with `kernels` those that reach kernels."""
    known = {target.name: target for target in targets}
    if unknown := set(names) - set(known):
        raise click.BadParameter(f"{min(unknown)!r} is none of {', '.join(known)}")
    if names:
        return [known[name] for name in dict.fromkeys(names)]
    return [target for target in targets if target.kernels or not kernels]


def _feed(target: Target, extra: list[bytes], seed: int, limits: Limits, jobs: int) -> Count:
    """Feed one target, with a line on the terminal about how far it is."""
    found, shown = Count(), time.monotonic()
    shows = sys.stderr.isatty()
    for found in run(target, target.make(), extra, seed=seed, limits=limits, jobs=jobs):  # noqa: B007
        if shows and time.monotonic() - shown > PROGRESS_SECONDS:
            shown = time.monotonic()
            click.echo(f"\r{target.name} …", nl=False, err=True)
    if shows:
        click.echo("\r\x1b[K", nl=False, err=True)
    return found


def _described(target: Target) -> str:
    kernels = ", reaches kernels" if target.kernels else ""
    return f"{target.name:<18} {target.group}{kernels}"


def _in_words(name: str, count: Count) -> str:
    """Return a line that sums up the inputs of a target."""
    rate = count.inputs / count.seconds if count.seconds else 0.0
    return (
        f"{name:<16} {count.inputs:>8} inputs, {count.inputs - count.refused:>8} read, "
        f"{rate:>6.0f}/s, slowest {count.slowest_ms:>5} ms, {count.peak_mb:>4} MB, "
        f"{len(count.findings)} findings"
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
        "findings": [
            {"reason": one.reason, "inputs": one.times} for one in count.findings.values()
        ],
    }


def replay(files: Sequence[Path], targets: Sequence[Target]) -> int:
    """Print what becomes of each file; return 1 where one fails, else 0."""
    failed = 0
    made: dict[str, Reader] = {}
    for path in files:
        data = path.read_bytes()
        own = [target for target in targets if path.name.startswith(f"{target.name}-")]
        named = sorted(own, key=lambda target: -len(target.name))[:1]
        for target in named or targets:
            reader = made.setdefault(target.name, target.make())
            only = reader._replace(corpus=[data])
            (count,) = list(run(target, only, limits=Limits(files=0.5, most_kinds=1)))[-1:]
            finding = next(iter(count.findings.values()), None)
            failed += finding is not None
            what = "is read" if not count.refused else "is refused"
            if finding:
                what = f"{finding.reason}\n{finding.details}"
            if finding or named:
                click.echo(f"{path}: {target.name}: {what}")
    return 1 if failed else 0
