"""Points, their transforms, frames and grids, pairs by distance, and the result of a match."""
