"""Extracted minutiae and recovered transforms compared with the known truth of synthetic prints."""
