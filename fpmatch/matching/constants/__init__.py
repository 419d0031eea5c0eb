"""Fixed numbers of the default matcher: kernels and reference read them from here.

Those that are arguments of the matcher are in `fpmatch.matching.parameters`. Lengths are
in pixels at 500 dpi.
"""
