"""Attacks on a server over HTTP, and what its ordinary clients notice of them."""
