"""A page as a list of inks, shapes and texts; painted into pixels by `raster`, vectors by `svg`."""
