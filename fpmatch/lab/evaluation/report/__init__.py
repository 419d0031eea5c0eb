"""The report on an evaluation: a value, and its text, JSON and page."""
