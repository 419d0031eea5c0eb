"""Databases whose prints are given, as they are once extracted."""

from pathlib import Path

from fpmatch.lab.evaluation.databases.dataset import Dataset
from fpmatch.lab.evaluation.databases.extraction import ExtractedSet, Extraction
from fpmatch.lab.evaluation.databases.protocol import Impression


def extracted_set(templates, name="made"):
    """Return a database of templates by finger and number; None where there is none."""
    taken = tuple(Impression(f, k, Path(f"{f}_{k}.tif")) for f, k in templates)
    made = tuple(Extraction(one, "" if one else "no ridges") for one in templates.values())
    return ExtractedSet(Dataset(name, 500.0, "", taken), made)
