"""The log of a campaign in several runs: a JSON line for each target of each run."""

from __future__ import annotations

import json
import os
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from research.fuzzing.loop import Count
    from research.fuzzing.targets.target import Target

GROUPS = {
    "readers": "all readers",
    "stores": "prepared files and galleries",
    "sanitized": "under AddressSanitizer",
}


def add(path: Path, target: Target, count: Count, *, run: str, seed: int, sanitized: bool) -> None:
    """Append what a run did with a target."""
    row = {
        "run": run,
        "target": target.name,
        "group": "sanitized" if sanitized else target.group,
        "seed": seed,
        "inputs": count.inputs,
        "refused": count.refused,
        "seconds": round(count.seconds, 2),
        "slowest_ms": count.slowest_ms,
        "peak_mb": count.peak_mb,
        "findings": [one.reason for one in count.findings.values()],
    }
    with path.open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(row) + "\n")


def read(path: Path) -> list[dict[str, Any]]:
    """Return the lines of a log; none where it is missing."""
    if not path.exists():
        return []
    try:
        return [json.loads(line) for line in path.read_text("utf-8").splitlines()]
    except ValueError as error:
        raise FpmatchError(f"{path}: not a log of a campaign") from error


def totals(rows: Sequence[dict[str, Any]]) -> str:
    """Return a line for each group of targets: inputs, findings, slowest and largest."""
    lines = []
    for group, title in GROUPS.items():
        ours = [row for row in rows if row["group"] == group]
        if group == "readers":  # galleries and prepared files are read, too
            ours = [row for row in rows if row["group"] != "sanitized"]
        if ours:
            kinds = {(row["target"], reason) for row in ours for reason in row["findings"]}
            lines.append(
                f"{title}: {sum(row['inputs'] for row in ours)} inputs in "
                f"{len({row['run'] for row in ours})} runs, {len(kinds)} findings, slowest "
                f"{max(row['slowest_ms'] for row in ours)} ms, "
                f"{max(row['peak_mb'] for row in ours)} MB"
            )
    return "\n".join(lines)


def name_of_run() -> str:
    """Return a name for a run that begins now."""
    return f"{datetime.now(UTC).isoformat()}-{os.getpid()}"
