"""Tables of the server's load and of attacks, on it and on the promises of the page on security."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


OTHER_SERVERS: Final = ("uvicorn", "hypercorn", "granian")


def format_serving(load: Mapping[str, Any]) -> str:
    """Format what ``research/benchmarks/serve_load.py --json`` wrote as a Markdown table."""
    title = f"{load['requests']} requests of {load['clients']} clients at once"
    before, after = (f"{load[f'memory_{when}_mb']:.0f} MB" for when in ("before", "after"))
    rows = [
        [f"{title}, {load['workers']} worker processes", "measured"],
        [f"refused (status 503) within the wait of {load['wait_s']:g} s", str(load["refused"])],
        ["responses that differ from those to single requests", str(load["wrong"])],
        ["response to a single request, median", f"{load['alone_s']:.2f} s"],
        ["to one of these, median", f"{load['p50_s']:.1f} s"],
        ["to one of these, 95th percentile", f"{load['p95_s']:.1f} s"],
        ["memory of server and workers before and after them", f"{before}, {after}"],
    ]
    return markdown_table(rows)


def format_attacks(outcomes: Sequence[Mapping[str, Any]]) -> str:
    """Format the results of ``scripts/attack_server --json`` as a Markdown table."""
    kinds = list(outcomes[0]["median_ms"])
    head = ["attack", "from", *(f"{kind}, ms" for kind in kinds), "refused", "wrong"]
    rows = [[*head, "memory, MB", "log, kB"]]
    for one in outcomes:
        times = [f"{one['median_ms'][kind]:.0f}, {one['p95_ms'][kind]:.0f}" for kind in kinds]
        before, most = one["memory_before_mb"], one["memory_most_mb"]
        row = [one["attack"], one["source"], *times]
        row += [f"{one['refused']} of {one['requests']}", str(one["wrong"])]
        rows.append([*row, f"{before:.0f} + {most - before:.0f}", f"{one['log_bytes'] / 1000:.0f}"])
    return markdown_table(rows, left=2)


def format_other_servers(results: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """Format what ``scripts/attack_server --main --server NAME --json`` measured, by server."""
    rows = [["server", "attack", "from", "verify, ms", "memory, MB", "log, kB", "connections"]]
    for server, outcomes in results.items():
        for one in outcomes:
            fates = [f"{number} {fate}" for fate, number in list(one["fates"].items())[:2]]
            rows.append(
                [
                    *(server, one["attack"], one["source"]),
                    f"{one['median_ms']['verify']:.0f}, {one['p95_ms']['verify']:.0f}",
                    f"{one['memory_most_mb'] - one['memory_before_mb']:+.0f}",
                    f"{one['log_bytes'] / 1000:.0f}",
                    ", ".join(fates) or "-",
                ]
            )
    return markdown_table(rows, left=3)


def format_promises(outcomes: Sequence[Mapping[str, Any]]) -> str:
    """Format what ``python -m research promises --json`` wrote as a Markdown table."""
    rows = [["promise", "attack", "outcome", "tries"]]
    for one in outcomes:
        tried = "kept" if not one["broken"] else f"broken {one['broken']:,} times"
        cells = [one["attack"], tried] if one["name"] else ["-", f"not tried: {one['attack']}"]
        rows.append([one["promise"], *cells, f"{one['tries']:,}"])
    return markdown_table(rows, left=3)
