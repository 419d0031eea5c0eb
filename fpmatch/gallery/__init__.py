"""Galleries: enrolled templates in a database, and identification (1:N) among them.

`open_gallery` opens one, `enrol` fills it, `Search` prepares its prints, `identify` ranks
its fingers for a probe, and `check_claim` verifies a claimed identity.
"""
