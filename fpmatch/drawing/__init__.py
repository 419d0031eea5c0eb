"""Pictures of results: overlays of prints, stages of an extraction, case reports.

An overlay is composed once, as a `scene` of inks, shapes and texts, and painted into pixels or
vectors. `stages` uses the same painters.
"""
