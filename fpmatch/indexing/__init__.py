"""Index of a large gallery: it selects the few prints that are compared with a probe."""
