"""Damaged files for every reader of templates and images."""
