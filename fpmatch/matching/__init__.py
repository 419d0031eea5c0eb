"""From two templates to a similarity, a transform and pairs of minutiae.

`verify` is the decision; `matchers` holds the matchers; each other module is one step of them.
Inner loops are in kernels, ``_*_kernel.py``, which run as they stand where they are not compiled.
"""
