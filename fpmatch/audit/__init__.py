"""Audit: who requested what and when, a chain of lines in a file or a gallery."""
