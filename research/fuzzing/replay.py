"""Read saved inputs again, as they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from research.fuzzing.loop import Limits, run

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from research.fuzzing.targets.target import Reader, Target


def replay(files: Sequence[Path], targets: Sequence[Target]) -> int:
    """Print what becomes of each file; return 1 where one fails, else 0.

    A file that a run saved is named after its target; others are read by all targets.
    """
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
