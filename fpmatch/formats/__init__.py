"""Template files in and out: one module a format, each defining its ``CODEC``."""
