"""Databases whose templates are given."""

from pathlib import Path

from fpmatch.lab.evaluation.databases.dataset import Dataset, Impression


def extracted_set(templates, name="made"):
    """Return a database of templates by finger and number; None where there is none."""
    taken = tuple(Impression(str(f), Path(f"{f}_{k}.tif"), f"{f}_{k}.tif") for f, k in templates)
    given = tuple(templates.values())
    return Dataset(name, taken, name, templates=given)
