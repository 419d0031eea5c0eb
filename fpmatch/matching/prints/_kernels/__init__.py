"""Kernels of the prepared prints: descriptors, their bits, and views of templates."""
