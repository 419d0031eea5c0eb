"""An evaluation as one page for a browser: tables, curves, and the hardest pairs."""
