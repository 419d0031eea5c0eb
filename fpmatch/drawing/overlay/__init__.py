"""The overlay of two prints, one over the other or side by side, with the decision in words.

`draw` chooses one of the `views`, each a `Scene` with the caption and the legend of `page`.
"""
