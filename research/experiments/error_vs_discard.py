"""Quality of the prints of databases, and the error versus discard curves that it gives."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from fpmatch.errors import FpmatchError
from fpmatch.image.extract import assess
from fpmatch.image.quality.print_quality import PrintQuality
from fpmatch.lab.evaluation.databases.dataset import with_unique_names
from fpmatch.lab.evaluation.databases.extraction import ExtractedSet, Extraction, attempt_each_image
from fpmatch.lab.evaluation.rates.error_rates import POOLED
from fpmatch.lab.evaluation.rates.error_vs_discard import (
    FMR,
    SHARES,
    QualitySample,
    discard_curve,
    pool,
)
from fpmatch.lab.evaluation.run import evaluate_templates, load_datasets
from research.commands import Command, folders, json_file, print_and_write, workers
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.lab.evaluation.report.results import SetResult


def sample_quality(
    datasets: Sequence[Dataset], *, workers: int | None = None
) -> list[QualitySample]:
    """Extract, grade and compare the prints of databases; without a template the quality is 0."""
    found = [
        [attempt.result for attempt in attempts if attempt.result]
        for attempts in attempt_each_image(datasets, _assess, stage="extract", workers=workers)
    ]
    sets = [
        ExtractedSet(dataset, tuple(extraction for extraction, _ in row))
        for dataset, row in zip(datasets, found, strict=True)
    ]
    report = evaluate_templates(sets, workers=workers)
    return [
        _sample(row, [quality for _, quality in of_set])
        for row, of_set in zip(report.sets, found, strict=True)
    ]


def curves_as_json(samples: Sequence[QualitySample]) -> dict[str, Any]:
    """Return the curves of some databases and of all together, ready for JSON."""
    every = [*samples, pool(samples)] if len(samples) > 1 else list(samples)
    return {
        "fmr": FMR,
        "shares": list(SHARES),
        "sets": [
            {
                **asdict(discard_curve(sample)),
                "quality": np.quantile(sample.quality, (0.05, 0.5, 0.95)).round(1).tolist(),
                "reasons": sample.reasons,
            }
            for sample in every
        ],
    }


def _assess(path: Path, dpi: float | None) -> tuple[Extraction, PrintQuality]:
    try:
        found = assess(path, dpi)
    except FpmatchError as error:
        return Extraction(None, str(error), 0.0), PrintQuality(0)
    none = "" if len(found.template.minutiae) else f"{path}: no minutiae found"
    return Extraction(None if none else found.template, none, 0.0), found.quality


def _sample(row: SetResult, qualities: Sequence[PrintQuality]) -> QualitySample:
    genuine = row.pairs.genuine
    scores = row.outcomes["similarity"].astype(np.float64)
    reasons = Counter(reason.code for quality in qualities for reason in quality.reasons)
    return QualitySample(
        row.name,
        np.array([quality.score for quality in qualities], np.float64),
        np.column_stack([row.pairs.probe, row.pairs.reference])[genuine],
        scores[genuine],
        scores[~genuine],
        reasons,
    )


def format_quality(results: Mapping[str, Any]) -> str:
    """Return the tables in Markdown, of each part what `curves_as_json` returned."""
    return "\n\n".join(discard_tables(part) for part in results.values())


def discard_tables(results: Mapping[str, Any]) -> str:
    """Return the tables of one part."""
    head = ["discarded", *(f"{100 * share:.0f} %" for share in results["shares"])]
    rows = [
        [row["name"], *(_rate(*pair) for pair in zip(row["lost"], row["genuine"], strict=True))]
        for row in results["sets"]
    ]
    rows += [
        [f"{row['name']}: quality at least", *map(str, row["below"])]
        for row in results["sets"]
        if row["name"] == POOLED
    ]
    names = list(dict.fromkeys(name for row in results["sets"] for name in row["reasons"]))
    prints = [["", "prints", "quality: 5 %", "median", "95 %", *names]]
    for row in results["sets"]:
        counts = [str(row["reasons"].get(name, 0)) for name in names]
        quantiles = [f"{value:.0f}" for value in row["quality"]]
        prints.append([row["name"], str(row["prints"]), *quantiles, *counts])
    return f"{markdown_table([head, *rows])}\n\n{markdown_table(prints)}"


def _rate(lost: int, genuine: int) -> str:
    return f"{100 * lost / max(1, genuine):.2f} % ({lost} of {genuine:,})"


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  python -m research error-vs-discard fvc/*/* --json fvc.json
  python -m research tables quality --fvc fvc.json
""",
)
@folders
@json_file
@workers
def command(folders: tuple[Path, ...], json_file: Path | None, workers: int | None) -> None:
    """Measure the false non-match rate where the worst prints are discarded.

    Prints are discarded in the order of their quality, on FVC-style databases DIR.
    """
    datasets = with_unique_names(load_datasets(folders))
    results = curves_as_json(sample_quality(datasets, workers=workers))
    print_and_write(discard_tables(results), results, json_file)
