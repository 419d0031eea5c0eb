"""Search of the prints of a gallery: its stages, on threads or workers, and who is a candidate."""
