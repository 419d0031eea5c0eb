"""The generated blocks of the documentation, from the results in ``docs/data``."""
