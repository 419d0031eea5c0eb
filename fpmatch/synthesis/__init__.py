"""Synthetic prints whose truth is known exactly: masters, impressions of them, whole databases."""
