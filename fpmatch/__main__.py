"""Run the command line as ``python -m fpmatch``."""

from fpmatch.cli import main

if __name__ == "__main__":
    main(prog_name="fpmatch")
