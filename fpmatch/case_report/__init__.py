"""The case report: one comparison, its files, settings, evidence and limits, on a page."""
