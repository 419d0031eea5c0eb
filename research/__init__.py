"""Development of fpmatch: what trains it, measures it, checks it and draws its documentation.

The package is not installed. ``python -m research --help``, run from the repository's root, lists
its commands; the scripts in ``research/benchmarks/`` use it too.
"""
