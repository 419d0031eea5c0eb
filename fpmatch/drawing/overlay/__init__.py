"""The overlay of two prints, one over the other or side by side, with the decision in words.

`draw` chooses the page, a `Scene`: `caption` above, `superposed`, `side_by_side` or `ridge_page`
below it, and the legend of `page`.
"""
