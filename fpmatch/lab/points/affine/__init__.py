"""Affine transforms between point sets: their class, and the matcher that finds them."""
