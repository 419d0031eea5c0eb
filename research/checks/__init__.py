"""Checks of the package on data, the sub-commands of ``python -m research check``."""
