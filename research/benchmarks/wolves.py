#!/usr/bin/env python3
"""Measure whether stated false match rates hold for fragments, and for templates made to match.

.venv/bin/python research/benchmarks/wolves.py DIR... [--json FILE] [--markdown FILE]
    [--keep FOLDER]
"""

import repository  # noqa: F401

from research.wolves.command import command

if __name__ == "__main__":
    command()
