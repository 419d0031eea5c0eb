"""Point pattern matching by similar triangles of the Delaunay triangulation."""
