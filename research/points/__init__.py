"""Matchers compared on random point sets, as in the paper."""
