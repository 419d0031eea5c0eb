"""From two templates to a similarity, a transform and pairs of minutiae.

`verify` is the decision; `matchers` holds the matchers; each other module is one step of them.
"""
