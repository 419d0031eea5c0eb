"""Measure the whole chain on FVC-style databases: many prints to a few error rates."""
