#!/usr/bin/env python3
"""Measure the default matcher on minutiae alone, of other extractors or of the package's own.

.venv/bin/python research/benchmarks/foreign_minutiae.py DIR... [--dpi DPI]... [--json FILE]
.venv/bin/python research/benchmarks/foreign_minutiae.py --templates DIR... [--format iso2005]
"""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np
import repository  # noqa: F401

from fpmatch.errors import DatasetError, TemplateError
from fpmatch.evaluation.databases.extraction import extract_datasets
from fpmatch.evaluation.rates.error_rates import Rates, error_rates
from fpmatch.evaluation.report.rate_text import RATE_TITLES, percent
from fpmatch.evaluation.run import load_datasets
from fpmatch.formats.files import decode_record, load_record
from fpmatch.formats.record import ReadingOptions, TemplateRecord, View
from fpmatch.formats.registry import codec_of_name, written_formats
from fpmatch.image.io.dataset_folder import read_dataset_info
from fpmatch.matching.matchers import DEFAULT_MATCHER
from fpmatch.minutiae import STANDARD_DPI, Template
from fpmatch.text_table import text_table
from research.all_pairs import compare_all_pairs
from research.commands import Command, folders, json_file, workers, write_json

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

PRINT_NAME: Final = re.compile(r"(\d+)_(\d+)", re.ASCII)
SHOWN: Final = ("eer", "fmr100", "fmr1000", "zero_fmr")


@dataclass(frozen=True)
class PrintSet:
    """The templates of a folder, and their fingers; None where an image gave none."""

    name: str
    dpi: float | None
    finger: list[int]
    templates: list[Template | None]


@dataclass(frozen=True)
class SetScores:
    """The similarities of all pairs of a folder."""

    prints: PrintSet
    similarity: np.ndarray
    genuine: np.ndarray

    def rates(self) -> Rates:
        """Return the error rates."""
        return error_rates(self.similarity[self.genuine], self.similarity[~self.genuine])

    def as_json(self) -> dict[str, Any]:
        """Return what was found as JSON values."""
        minutiae = [len(t.minutiae) for t in self.prints.templates if t is not None]
        return {
            "name": self.prints.name,
            "dpi": self.prints.dpi,
            "prints": len(self.prints.templates),
            "failures": self.prints.templates.count(None),
            "minutiae": float(np.median(minutiae)) if minutiae else 0.0,
            "genuine": int(self.genuine.sum()),
            "impostor": int((~self.genuine).sum()),
            **asdict(self.rates()),
        }


def read_minutiae(path: Path, dpi: float) -> Template:
    """Return the template of one CSV file."""
    options = ReadingOptions(dpi=dpi)
    return load_record(path, file_format="minutiae-csv", options=options).single().template


def read_folder(folder: Path, dpi: float | None) -> PrintSet:
    """Return the templates of a folder of CSV files; `dpi` None for the folder's own, or 500."""
    found = {}
    for path in folder.glob("*.csv") if folder.is_dir() else ():
        named = PRINT_NAME.fullmatch(path.stem)
        if named is not None:
            found[int(named[1]), int(named[2])] = path
    if not found:
        raise DatasetError(f"{folder}: contains no minutiae named FFF_M.csv")
    resolution = dpi or read_dataset_info(folder).dpi or STANDARD_DPI
    order = sorted(found)
    templates = [read_minutiae(found[key], resolution) for key in order]
    return PrintSet(str(folder), resolution, [finger for finger, _ in order], templates)


def converted(template: Template, file_format: str) -> Template:
    """Return a template that was encoded in a format and decoded again."""
    codec = codec_of_name(file_format)
    if codec.encode is None:
        raise TemplateError(f"{codec.title} is only read, not written")
    encoded = codec.encode(TemplateRecord("", (View(template),)))
    return decode_record(encoded.data, "template", file_format=file_format).single().template


def own_templates(folders: Sequence[Path], file_format: str, workers: int | None) -> list[PrintSet]:
    """Return the templates of databases of images, converted to a format."""
    sets = extract_datasets(load_datasets(folders), workers=workers)
    found = []
    for folder, extracted in zip(folders, sets, strict=True):
        templates: list[Template | None] = []
        for extraction in extracted.extractions:
            template = extraction.template
            templates.append(None if template is None else converted(template, file_format))
        finger = [impression.finger for impression in extracted.dataset.impressions]
        found.append(PrintSet(str(folder), extracted.dataset.dpi, finger, templates))
    return found


def compared(prints: PrintSet, workers: int | None) -> SetScores:
    """Compare all pairs of a folder; what has no template scores 0."""
    there = np.array([template is not None for template in prints.templates])
    templates = [template for template in prints.templates if template is not None]
    probe, reference = np.triu_indices(len(there), 1)
    similarity = np.zeros(len(probe))
    similarity[there[probe] & there[reference]] = compare_all_pairs(templates, workers=workers)
    finger = np.array(prints.finger)
    return SetScores(prints, similarity, finger[probe] == finger[reference])


def mean_of(rates: list[Rates]) -> Rates:
    """Return the mean of each rate; None where a folder lacks it."""
    columns = [[getattr(row, f.name) for row in rates] for f in fields(Rates)]
    return Rates(*(None if None in column else float(np.mean(column)) for column in columns))


def resolutions(given: Sequence[float], folders: int) -> list[float | None]:
    """Return the resolution of each folder from those given: none, one, or one for each."""
    if len(given) not in (0, 1, folders):
        raise DatasetError(f"--dpi is given {len(given)} times for {folders} folders")
    return [*given] if len(given) == folders else [given[0] if given else None] * folders


@click.command(cls=Command)
@folders
@click.option("--dpi", type=float, multiple=True, help="Once for all folders, or once for each.")
@click.option("--templates", is_flag=True, help="The folders contain images; extract them.")
@click.option(
    "--format",
    "file_format",
    type=click.Choice(written_formats()),
    default="iso2005",
    show_default=True,
    help="Of the templates of --templates; json keeps the ridges.",
)
@json_file
@workers
def main(
    folders: tuple[Path, ...],
    dpi: tuple[float, ...],
    templates: bool,
    file_format: str,
    json_file: Path | None,
    workers: int | None,
) -> None:
    """Measure the default matcher on minutiae alone, of other extractors or of the package's own.

    Each DIR holds files FFF_M.csv (finger FFF, impression M) in the format minutiae-csv of the
    package, with the columns x, y, theta, type and quality. A quality of 0 in all minutiae of a
    file means that none is given. The files contain no image size: it is the extent of the
    minutiae. The resolution is that of --dpi; without it, that of a dataset.toml in the folder,
    else 500 dpi. FVC2002 DB2 has 569 dpi.

    With --templates, each DIR is an FVC-style database of images: its templates are extracted, and
    encoded and decoded in memory in the given format, by default ISO/IEC 19794-2:2005, which
    contains minutiae alone.

    Printed are EER, FMR100, FMR1000 and ZeroFMR in percent by the extended protocol: all pairs of
    impressions of one finger are genuine, all pairs of impressions of different fingers of a folder
    are impostor pairs. --json writes them as fractions.
    """
    if templates and dpi:
        raise DatasetError("--dpi has no use with --templates: see dataset.toml")
    if templates:
        sets = own_templates(folders, file_format, workers)
    else:
        resolved = resolutions(dpi, len(folders))
        sets = [read_folder(*row) for row in zip(folders, resolved, strict=True)]
    scores = [compared(prints, workers) for prints in sets]
    mean = mean_of([one.rates() for one in scores])
    pooled = error_rates(
        np.concatenate([one.similarity[one.genuine] for one in scores]),
        np.concatenate([one.similarity[~one.genuine] for one in scores]),
    )
    rows = [one.as_json() for one in scores]
    if json_file:
        document = {
            "matcher": DEFAULT_MATCHER,
            "format": file_format if templates else "csv",
            "sets": rows,
            "mean": asdict(mean),
            "pooled": asdict(pooled),
        }
        write_json(json_file, document)
    counts = ("dpi", "prints", "failures", "minutiae", "genuine", "impostor")
    cells = [("folder", *counts, *(RATE_TITLES[name] for name in SHOWN))]
    for row in rows:
        numbers = ("-" if row[name] is None else f"{row[name]:g}" for name in counts)
        cells.append((row["name"], *numbers, *(percent(row[name]) for name in SHOWN)))
    if len(rows) > 1:
        for name, rates in (("mean", mean), ("pooled", pooled)):
            shown = (percent(getattr(rates, rate)) for rate in SHOWN)
            cells.append((name, *("" for _ in counts), *shown))
    click.echo(text_table(cells))


if __name__ == "__main__":
    main()
