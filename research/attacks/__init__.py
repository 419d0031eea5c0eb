"""Attacks: on a server over HTTP, on revocable templates, and by two prints joined into one."""
