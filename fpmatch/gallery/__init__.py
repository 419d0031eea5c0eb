"""Enrolled templates in a database, and the search of one print among them all."""
