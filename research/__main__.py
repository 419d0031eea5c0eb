"""The entry point of ``python -m research``."""

from research.commands import research

research(prog_name="research")
