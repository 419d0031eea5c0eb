"""Kernels of the pipeline, each named after its step."""
