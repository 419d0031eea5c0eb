"""Templates: minutiae, ridge field, and the bounds of their numbers."""
