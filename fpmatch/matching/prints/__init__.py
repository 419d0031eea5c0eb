"""Prepared prints: what the matcher computes once for each print, of one and of many."""
