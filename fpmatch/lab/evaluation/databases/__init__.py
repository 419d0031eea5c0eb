"""Databases of prints: their impressions, templates, pairs and comparisons."""
