"""Plots by matplotlib that look the same everywhere, and the plot of two matched point sets."""
