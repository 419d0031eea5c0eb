"""Attacks on the promises of ``docs/security.md``, from outside: by commands, HTTP and files.

They were written from the documentation, without the code of the package and its tests.
"""
