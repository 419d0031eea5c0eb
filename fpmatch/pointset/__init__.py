"""The paper's method on bare 2-D points: triangulation, unit circle, transform, pairs, matcher."""
