"""Development code: what trains the package, measures it and writes the tables of its pages.

The package does not import it and does not install it; scripts, benchmarks and tests do.
"""
