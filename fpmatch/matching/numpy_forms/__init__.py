"""Numpy forms of loops of the kernels, which take their place where these are not compiled.

Each does the same arithmetic in the same order as the loop, on whole arrays: the results are the
same to the last bit.
"""
