"""The generated blocks of the documentation: their results, and the functions that format them.

Results of measurements are kept as JSON in ``docs/data``. A block stands between the comments
``MARK:start`` and ``MARK:end`` of its page.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import atomic_write_bytes
from fpmatch.errors import DatasetError
from research.commands import ROOT, write_json
from research.experiments.error_vs_discard import format_quality
from research.markdown import marked_block, write_marked_block
from research.points.plot import save_bench_plot
from research.points.results import read_results
from research.points.table import format_bench
from research.tables.accuracy import error_rates_kept, format_accuracy, format_databases
from research.tables.identification import (
    SEARCHED,
    format_fusion,
    format_identification,
    format_tail,
    tests_kept,
)
from research.tables.joined import format_joined, joined_kept
from research.tables.performance import format_headline, format_ratios, format_stages
from research.tables.points import PARTS as POINT_PARTS
from research.tables.points import format_paper_choices
from research.tables.revocable import format_revocable
from research.tables.scale import format_scale
from research.tables.searching import format_before, format_searching
from research.tables.serving import (
    OTHER_SERVERS,
    format_attacks,
    format_other_servers,
    format_promises,
    format_serving,
)
from research.tables.stored_prints import format_stored
from research.tables.synthesis import format_synthesis, format_templates, preset_rows

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

DOCS: Final = ROOT / "docs"
README: Final = ROOT / "README.md"


def read_json(path: Path) -> Any:
    """Read a JSON file."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DatasetError(f"{path}: cannot be read: {(error.strerror or '').lower()}") from error
    except ValueError as error:
        raise DatasetError(f"{path}: not a JSON file") from error


@dataclass(frozen=True)
class Part:
    """Describe the results of one measurement.

    `help`: the command that measures them. `file`: the file in ``docs/data``. `alone`: whether the
    file holds this part alone; otherwise it is an entry of the part's name. `keep`: takes from the
    measured results what is kept. `read`: reads a file that holds the part alone.
    """

    help: str
    file: str
    alone: bool = False
    keep: Callable[[Any], Any] = lambda measured: measured
    read: Callable[[Path], Any] = read_json


@dataclass(frozen=True)
class Page:
    """Describe a page: the parts that it shows by name, and its blocks by file and mark.

    A block is formatted from all parts. `draw` writes a figure of them.
    """

    parts: Mapping[str, Part]
    blocks: Mapping[tuple[Path, str], Callable[[Mapping[str, Any]], str]] = field(repr=False)
    draw: Callable[[Mapping[str, Any]], None] | None = None


def _explanation(name: str) -> Path:
    return DOCS / "explanation" / name


def _tables(name: str) -> Path:
    return DOCS / "tables" / name


def _shown(
    format_part: Callable[[Any], Any], part: str, block: str = ""
) -> Callable[[Mapping[str, Any]], str]:
    """Return what formats one part; `block` names one of several blocks that it gives."""

    def formatted(results: Mapping[str, Any]) -> str:
        made = format_part(results[part])
        return str(made[block] if block else made)

    return formatted


def _points_plot(results: Mapping[str, Any]) -> None:
    save_bench_plot(DOCS / "figures" / "points_bench.svg", results["bench"])


_LEARNED: Final = Part("fpmatch evaluate DIR... --json", "accuracy.json", keep=error_rates_kept)
_FILTERS: Final = replace(_LEARNED, help="fpmatch evaluate DIR... --enhance filters --json")
_PAPER: Final = replace(_LEARNED, help="fpmatch evaluate DIR... --matcher paper --json")
_SEARCHES: Final = Part(
    "fpmatch evaluate-identification DIR... --fingers 2 --json",
    "identification.json",
    keep=tests_kept,
)
_DISCARDED: Final = ("fvc", "synthetic")
_BENCH: Final = Part(
    "scripts/bench --json", "performance.json", keep=lambda measured: measured["figures"]
)

PAGES: Final = {
    "readme": Page(
        {"learned": _LEARNED, "paper": _PAPER, "figures": _BENCH},
        {(README, "headline"): format_headline},
    ),
    "accuracy": Page(
        {
            "learned": _LEARNED,
            "filters": _FILTERS,
            "paper": _PAPER,
            "ablation": Part("python -m research train score --ablation", "accuracy.json"),
            "parts": Part("research/benchmarks/ablation.py --json", "accuracy.json"),
            "calibration": Part("python -m research check calibration --json", "accuracy.json"),
            "wolves": Part("python -m research measure wolves --json", "accuracy.json"),
            "outcomes": Part("python -m research measure outcomes --json", "accuracy.json"),
            "distortion": Part("research/benchmarks/distortion.py --json", "accuracy.json"),
            "places": Part("research/benchmarks/minutiae_places.py --json", "accuracy.json"),
            "distortion_before": Part(
                "the same as distortion, of an earlier version",
                "distortion_before.json",
                alone=True,
            ),
        },
        {
            (_tables("accuracy.md"), "measured"): format_accuracy,
            (_explanation("accuracy.md"), "databases"): format_databases,
        },
    ),
    "performance": Page(
        {
            "figures": _BENCH,
            "before": Part(
                "research/benchmarks/stages.py --json, of an earlier version", "performance.json"
            ),
            "now": Part("research/benchmarks/stages.py --json", "performance.json"),
        },
        {
            (_explanation("performance.md"), "figures"): format_ratios,
            (_explanation("performance.md"), "stages"): format_stages,
        },
    ),
    "identification": Page(
        {
            **{
                part: replace(_SEARCHES, help=", ".join(filter(None, [_SEARCHES.help, where])))
                for part, where in SEARCHED.items()
            },
            "fusion": Part(
                "python -m research measure fused-fingers --json", "identification.json"
            ),
            "tail": Part(
                "research/benchmarks/impostor_tail.py --json", "impostor_tail.json", alone=True
            ),
        },
        {
            (DOCS / "how-to" / "identification.md", "identification"): format_identification,
            (DOCS / "how-to" / "identification.md", "fusion"): _shown(format_fusion, "fusion"),
            (DOCS / "how-to" / "identification.md", "tail"): _shown(format_tail, "tail"),
        },
    ),
    "points": Page(
        {
            "bench": Part(
                "python -m research measure points --json",
                "pointsets_bench.json",
                alone=True,
                read=read_results,
            ),
            "choices": Part(
                "python -m research measure paper-choices --json", "paper_choices.json", alone=True
            ),
        },
        {
            (_tables("point_sets.md"), "measured"): _shown(format_bench, "bench"),
            **{
                (_explanation("point_sets.md"), part): _shown(format_paper_choices, "choices", part)
                for part in POINT_PARTS
            },
        },
        draw=_points_plot,
    ),
    "promises": Page(
        {"attacks": Part("python -m research promises --json", "promises.json", alone=True)},
        {(DOCS / "security.md", "promises"): _shown(format_promises, "attacks")},
    ),
    "quality": Page(
        {
            part: Part("python -m research error-vs-discard DIR... --json", "quality.json")
            for part in _DISCARDED
        }
        | {
            "joined": Part(
                "python -m research measure joined DIR... --json", "quality.json", keep=joined_kept
            )
        },
        {
            (_explanation("quality.md"), "measured"): lambda results: format_quality(
                {part: results[part] for part in _DISCARDED}
            ),
            (_explanation("quality.md"), "joined"): _shown(format_joined, "joined"),
        },
    ),
    "revocable": Page(
        {
            "measured": Part(
                "python -m research measure revocable --json", "revocable.json", alone=True
            )
        },
        {(_explanation("revocable_templates.md"), "measured"): format_revocable},
    ),
    "scale": Page(
        {"plan": Part("python -m research scale plan --json", "scale.json", alone=True)},
        {
            (DOCS / "scale.md", name): _shown(format_scale, "plan", name)
            for name in ("constants", "plans", "simulation", "limits", "assumptions")
        },
    ),
    "searching": Page(
        {
            "large": Part(
                "research/benchmarks/large_galleries.py --json", "searching.json", alone=True
            ),
            "before": Part(
                "the same as large, of an earlier version", "searching_before.json", alone=True
            ),
            "stored": Part(
                "research/benchmarks/compact_templates.py --json", "stored_prints.json", alone=True
            ),
        },
        {
            (_tables("searching.md"), "measured"): _shown(format_searching, "large"),
            (_tables("searching.md"), "before"): format_before,
            (_explanation("searching.md"), "stored"): _shown(format_stored, "stored"),
        },
    ),
    "serving": Page(
        {
            "load": Part("research/benchmarks/serve_load.py --json", "serving.json", alone=True),
            "attacks": Part("scripts/attack_server --json", "attacks.json", alone=True),
            "hanging": Part(
                "scripts/attack_server --hangs --from 127.0.0.1 --database URL --json",
                "hanging.json",
                alone=True,
            ),
            **{
                name: Part(f"scripts/attack_server --main --server {name} --json", "servers.json")
                for name in OTHER_SERVERS
            },
        },
        {
            (DOCS / "how-to" / "serve.md", "load"): _shown(format_serving, "load"),
            (DOCS / "how-to" / "deploy.md", "attacks"): _shown(format_attacks, "attacks"),
            (DOCS / "how-to" / "deploy.md", "hanging"): _shown(format_attacks, "hanging"),
            (DOCS / "how-to" / "deploy.md", "servers"): lambda results: format_other_servers(
                {name: results[name] for name in OTHER_SERVERS}
            ),
        },
    ),
    "synthesis": Page(
        {
            "prints": Part("python -m research compare-prints --json", "synthesis.json"),
            "presets": Part(
                "fpmatch evaluate DIR... --ground-truth --json, a database a preset",
                "synthesis.json",
                keep=preset_rows,
            ),
            "templates": Part("python -m research compare-templates --json", "synthesis.json"),
        },
        {
            (_explanation("synthesis.md"), "measured"): format_synthesis,
            (_explanation("synthesis.md"), "templates"): _shown(format_templates, "templates"),
        },
    ),
}


def load_results(page: Page) -> dict[str, Any]:
    """Return the kept results of a page by part."""
    results = {}
    for name, part in page.parts.items():
        path = DOCS / "data" / part.file
        if part.alone:
            results[name] = part.read(path)
            continue
        document = read_json(path)
        if name not in document:
            raise DatasetError(f"{path}: lacks {name}")
        results[name] = document[name]
    return results


def keep_results(page: Page, given: Mapping[str, Path]) -> None:
    """Put measured results, a file a part, in place of those that are kept."""
    for name, source in given.items():
        part, target = page.parts[name], DOCS / "data" / page.parts[name].file
        if part.alone:
            part.read(source)  # refuses what the page could not show
            atomic_write_bytes(target, source.read_bytes(), public=True)
        else:
            known = read_json(target) if target.exists() else {}
            write_json(target, {**known, name: part.keep(read_json(source))})


def write_blocks(changed: Page) -> None:
    """Write the blocks and the figure of a page, and of those that share its results."""
    files = {part.file for part in changed.parts.values()}
    for page in PAGES.values():
        if page is changed or files & {part.file for part in page.parts.values()}:
            results = load_results(page)
            for (path, mark), format_block in page.blocks.items():
                write_marked_block(path, mark, format_block(results))
            if page.draw is not None:
                page.draw(results)


def outdated_blocks() -> list[str]:
    """Return the blocks of all pages that differ from what their results give."""
    outdated = []
    for page in PAGES.values():
        results = load_results(page)
        for (path, mark), format_block in page.blocks.items():
            if marked_block(path.read_text("utf-8"), mark) != format_block(results).strip():
                outdated.append(f"{path.relative_to(ROOT)}: the block {mark!r}")
    return outdated
