"""Revocable templates: minutiae under a key, compared without it; another key, another template.

A research feature: docs/explanation/revocable_templates.md states what it holds and what it costs.
"""
