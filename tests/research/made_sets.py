"""Databases whose templates are given."""

from pathlib import Path

from fpmatch.lab.evaluation.databases.dataset import Dataset, Impression


def extracted_set(templates, name="made"):
    """Return a database of templates by finger and number; None where there is none."""
    taken = tuple(Impression(f, k, Path(f"{f}_{k}.tif")) for f, k in templates)
    given = tuple(templates.values())
    return Dataset(name, 500.0, "", taken, name, templates=given)
