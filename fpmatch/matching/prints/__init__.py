"""Prepared prints: what the matcher computes once for each print."""
