"""Pictures of what was found: the overlay of two prints, and the stages of an extraction.

`overlay` and `stage_sheet` are the doors of the room. An overlay is composed once, as a `scene`
of inks, shapes and text, and painted twice: into pixels by `raster`, into vectors by `svg`.
"""
