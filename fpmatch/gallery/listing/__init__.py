"""Prints to enrol or to compare: labels, files, folders, manifests and galleries as sources."""
