"""Quality and polarity of a print, estimated from its image."""
