"""Templates: minutiae, ridge field, their bounds, and templates in few bytes as they are stored."""
