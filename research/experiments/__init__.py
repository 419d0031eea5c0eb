"""Measurements for the documentation: what is compared, and the results as values or text."""
