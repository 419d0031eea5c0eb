"""Preprocessing: normalization, segmentation, and images as grids of blocks."""
