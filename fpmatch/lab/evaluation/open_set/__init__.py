"""Open-set identification: searches of which a third have a mate in the gallery."""
