"""Measure the whole chain on databases of prints: many prints to a few error rates."""
