"""Synthetic prints with ground truth: master prints, their impressions, whole databases."""
