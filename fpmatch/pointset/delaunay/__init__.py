"""Delaunay triangulation of any finite point set, with one-rings (the paper's section 3.1)."""
