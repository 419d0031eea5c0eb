"""Scoring of whole batches of templates: streamed to a file, resumed after an interruption."""
