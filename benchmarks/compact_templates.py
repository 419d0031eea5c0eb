#!/usr/bin/env python3
"""Measure what it costs to keep templates as galleries do: their bytes, and error rates.

    .venv/bin/python benchmarks/compact_templates.py DIR...

Each DIR is an FVC-style database. The rates of all are printed twice, with templates as they are
extracted and as they come back from a gallery.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import click
import numpy as np

from fpmatch.evaluation.extraction import ExtractedSet, Extraction, extract_datasets
from fpmatch.evaluation.run import evaluate_templates, load_datasets
from fpmatch.gallery.compact import pack_template, unpack_template


def kept(extraction: Extraction) -> Extraction:
    """Return an extraction whose template has been in a gallery."""
    if extraction.template is None:
        return extraction
    return replace(extraction, template=unpack_template(pack_template(extraction.template)))


def print_sizes(sets: list[ExtractedSet]) -> None:
    """Print how many bytes a template takes."""
    templates = [e.template for s in sets for e in s.extractions if e.template is not None]
    size = np.array([len(pack_template(template)) for template in templates])
    minutiae = np.array([len(template.minutiae) for template in templates])
    print(f"{len(size)} templates, {np.median(minutiae):.0f} minutiae in the median")
    print(f"bytes: {np.median(size):.0f} in the median, {size.max()} at most")
    near = size[(minutiae >= 45) & (minutiae <= 50)]
    if len(near):
        print(f"of 45 to 50 minutiae: {np.median(near):.0f} in the median, {near.max()} at most")


@click.command()
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path))
def main(folders: tuple[Path, ...]) -> None:
    """Measure on the databases FOLDERS."""
    sets = extract_datasets(load_datasets(folders))
    print_sizes(sets)
    print("\nas extracted")
    print(evaluate_templates(sets).as_text())
    print("\nfrom a gallery")
    packed = [ExtractedSet(s.dataset, tuple(map(kept, s.extractions))) for s in sets]
    print(evaluate_templates(packed).as_text())


if __name__ == "__main__":
    sys.exit(main())
