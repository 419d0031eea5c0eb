"""The overlay of two prints, one over the other or side by side, with the decision in words.

`draw` composes a page as a `Scene`: `caption` above, `superposed` or `side_by_side` in the middle,
`legend` below.
"""
