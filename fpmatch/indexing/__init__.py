"""Index of a large gallery: from a probe to the few prints that are compared with it."""
