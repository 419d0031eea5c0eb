"""Bare point sets: matchers of two sets, random sets, and the experiment of the paper."""
