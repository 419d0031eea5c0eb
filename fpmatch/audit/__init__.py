"""Audit: who requested what and when, as a chain of lines in a file or a gallery."""
