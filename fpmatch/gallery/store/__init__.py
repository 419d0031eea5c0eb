"""The database of a gallery: rows, history, encryption at rest, audit."""
