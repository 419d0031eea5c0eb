"""Shared by all folders of the package: files, texts, tables, binary records, plug-ins and kernels.

These modules import nothing of the package but `fpmatch.errors` and the version.
"""
