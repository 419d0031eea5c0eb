"""Engines that do the work of batches: in this process, in several, or on a cluster."""
