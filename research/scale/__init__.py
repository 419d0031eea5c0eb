"""Galleries beyond one machine, planned on paper and by simulation, from measured constants."""
