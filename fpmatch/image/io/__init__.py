"""Image files become grey images: decoders, the registry of formats, limits and resolution."""
