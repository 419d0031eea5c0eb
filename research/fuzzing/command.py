"""The command ``fuzz``."""

from __future__ import annotations

import math
import sys
import time
from typing import TYPE_CHECKING, Any, Final

import click

from research.commands import PATH, Command
from research.fuzzing.loop import Limits, outcome, run
from research.fuzzing.sanitizer import run_sanitized
from research.fuzzing.targets import all_targets

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from research.fuzzing.target import Target

SANITIZED: Final[dict[str, Any]] = {"hang_seconds": 60.0, "peak_mb": 4000.0}
"""Limits of instrumented code, which takes ten times as long, and keeps what is freed."""


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  scripts/fuzz --seconds 300
  scripts/fuzz --seconds 60 --target iso2005 --target an2 my.iso their.an2
  scripts/fuzz --sanitize --seconds 300
  scripts/fuzz out/fuzz/json-0123456789ab.bin
""",
)
@click.argument("files", metavar="[FILE]...", nargs=-1, type=PATH)
@click.option(
    "--seconds",
    type=click.FloatRange(0, min_open=True),
    help="For all targets together.  [default: 60, unless FILEs are given alone]",
)
@click.option("--target", "names", multiple=True, help="Only this target (repeatable).")
@click.option("--seed", default=0, show_default=True, help="Another seed gives other inputs.")
@click.option("--into", type=PATH, default="out/fuzz", show_default=True, help="For findings.")
@click.option(
    "--sanitize",
    is_flag=True,
    help="Build the kernels with AddressSanitizer, and feed the targets that reach them.",
)
@click.option("--list", "list_targets", is_flag=True, help="List the targets, and end.")
@click.pass_context
def command(
    context: click.Context,
    files: tuple[Path, ...],
    seconds: float | None,
    names: tuple[str, ...],
    seed: int,
    into: Path,
    sanitize: bool,
    list_targets: bool,
) -> None:
    """Feed damaged files to every reader of files, requests and arrays.

    A reader may read an input or refuse it by one line, one of fpmatch's own errors. Anything else
    is a finding: another error, the end of the process, 5 seconds of work, 1 GB of memory, control
    characters in a line, or a search of a damaged gallery that returns other candidates without a
    word. The first input of each kind is saved with its traceback, and the exit status is 1.

    FILEs alone are read as they are, by the target that their names begin with, or by all: so a
    finding is replayed. With --seconds each FILE is another file to damage. The time is shared
    evenly among the targets.
    """
    known = {target.name: target for target in all_targets()}
    if unknown := set(names) - set(known):
        raise click.BadParameter(f"{min(unknown)!r} is none of {', '.join(known)}")
    if list_targets:
        click.echo("\n".join(known))
        return
    chosen = [known[name] for name in names or known]
    if sanitize:
        run_sanitized(sys.argv[1:])
        chosen = [target for target in chosen if target.kernels or names]
    if files and seconds is None:
        context.exit(replay(files, chosen))
    extra = [path.read_bytes() for path in files]
    limits = Limits((seconds or 60.0) / len(chosen), math.inf, **(SANITIZED if sanitize else {}))
    inputs = kinds = 0
    for target in chosen:
        start = time.monotonic()
        found = run(target, target.make(), extra, seed=seed, limits=limits)
        rate = found.inputs / (time.monotonic() - start)
        click.echo(
            f"{target.name:<20} {found.inputs:>8} inputs, {found.refused:>8} refused, "
            f"{rate:>6.0f}/s, {len(found.findings)} findings"
        )
        for finding in found.findings.values():
            click.echo(f"  {finding.save(into)}: {finding.reason} ({finding.times} inputs)")
        inputs, kinds = inputs + found.inputs, kinds + len(found.findings)
    click.echo(f"{inputs} inputs, {kinds} findings, seed {seed}")
    context.exit(1 if kinds else 0)


def replay(files: Sequence[Path], targets: Sequence[Target]) -> int:
    """Print what becomes of each file; return 1 where one fails, else 0."""
    failed = 0
    for path in files:
        data = path.read_bytes()
        own = [target for target in targets if path.name.startswith(f"{target.name}-")]
        named = sorted(own, key=lambda target: -len(target.name))[:1]
        for target in named or targets:
            refused, failure = outcome(target.make(), data)
            failed += failure is not None
            what = "\n".join(failure) if failure else "is refused" if refused else "is read"
            if failure or named:
                click.echo(f"{path}: {target.name}: {what}")
    return 1 if failed else 0
