"""From two templates to a similarity, a transform and pairs of minutiae.

`verify` is the decision; `matchers` holds the matchers; each other module is one step of them.
Inner loops are in kernels, ``_*_kernel.py``, which run compiled only. Where they are not compiled,
the default matcher takes the steps of `reference`, in numpy and scipy.
"""
